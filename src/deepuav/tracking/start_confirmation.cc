#include "deepuav/tracking/start_confirmation.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "deepuav/estimation/poses/motion_only.h"

namespace deepuav {
namespace {

/// Of camera a's points. Nothing where they do not tell it.
std::optional<SE3> ThirdView(const Pinhole& pinhole, const TwoViewSolution& solution,
                             const std::vector<SeenThrice>& seen, uint64_t seed,
                             const TwoViewOptions& options,
                             const AbsolutePoseOptions& pose_options) {
  // A solution with hardly a point of known distance is no start, but may be what a false one
  // hides: what it sees far away tells its pose.
  const bool may_start = solution.certain_count >= options.min_certain;
  const std::vector<uint8_t>& tells_pose = may_start ? solution.certain : solution.valid;
  std::vector<PoseObservation> observations;
  for (const SeenThrice& point : seen) {
    if (tells_pose[point.match])
      observations.push_back({solution.points_a[point.match], point.px.c_px});
  }
  const auto robust = EstimateAbsolutePose(pinhole, observations, seed, pose_options);
  if (!robust) return std::nullopt;
  return OptimisePose(pinhole, observations, robust->cam_from_world, MotionOnlyOptions{})
      .cam_from_world;
}

}  // namespace

Confirmation ConfirmBy(const Pinhole& pinhole, const TwoViewSolution& solution,
                       const std::vector<SeenThrice>& seen, uint64_t seed,
                       const TwoViewOptions& options, const AbsolutePoseOptions& pose_options) {
  Confirmation confirmation;
  confirmation.errors.assign(seen.size(), 1);
  ThreeViews views{solution.b_from_a, SE3(), {}};
  std::vector<PixelTriple> triples;
  for (const SeenThrice& point : seen) {
    triples.push_back(point.px);
    views.points_a.push_back(solution.points_a[point.match]);
    confirmation.matched += solution.certain[point.match];
  }
  const auto c_from_a = ThirdView(pinhole, solution, seen, seed, options, pose_options);
  if (!c_from_a) return confirmation;
  views.c_from_a = *c_from_a;
  AdjustThreeViews(pinhole, triples, options.max_error_px, &views);
  const SE3 third_from_second = views.c_from_a * views.b_from_a.Inverse();
  confirmation.baseline_ratio =
      third_from_second.translation().norm() / views.b_from_a.translation().norm();
  confirmation.errors = WeightedErrors(pinhole, triples, views, options.max_error_px);
  const std::vector<double> errors = TruncatedErrors(pinhole, triples, views, options.max_error_px);
  for (size_t i = 0; i < seen.size(); ++i)
    confirmation.confirmed += solution.certain[seen[i].match] && errors[i] < 1;
  return confirmation;
}

bool IsAlone(size_t best, const std::vector<Confirmation>& found, double min_lead) {
  std::vector<double> sums(found.size(), 0);
  for (size_t point = 0; point < found[best].errors.size(); ++point) {
    const bool explained = std::any_of(found.begin(), found.end(), [point](const auto& solution) {
      return solution.errors[point] < 1;
    });
    for (size_t i = 0; i < found.size() && explained; ++i) sums[i] += found[i].errors[point];
  }
  for (size_t i = 0; i < found.size(); ++i) {
    if (i != best && sums[i] < min_lead * sums[best]) return false;
  }
  return true;
}

double LeastSigmaPx(const TwoViewResult& result) {
  double least = std::numeric_limits<double>::infinity();
  for (const TwoViewSolution& solution : result.solutions)
    least = std::min(least, solution.sigma_px);
  return least;
}

}  // namespace deepuav
