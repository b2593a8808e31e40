#include "deepuav/estimation/two_views/two_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"
#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "deepuav/estimation/poses/reprojection.h"
#include "deepuav/estimation/two_views/two_view_certainty.h"
#include "deepuav/estimation/two_views/two_view_models.h"
#include "deepuav/geometry/triangulation.h"

namespace deepuav {
namespace {

constexpr double kRadiansPerDegree = M_PI / 180;
/// Relative to the median, the parallax of points that the first refinement leaves out.
constexpr double kHighParallaxRatio = 2;
constexpr size_t kMaxSolutions = 4;
/// Of the bound on a pixel's error, the parallax of points that are put far away: little enough to
/// fit, and enough for an adjustment to move them further without a step to behind the cameras.
constexpr double kFarParallax = 0.5;
/// Poses nearer than this in rotation and direction of travel are one: the two that explain a plane
/// differ by more.
constexpr double kSamePoseRad = 5 * kRadiansPerDegree;

struct TwoViewProblem {
  const Pinhole& pinhole;
  const std::vector<PixelPair>& pairs;
  const TwoViewOptions& options;
};

/// Squared distance to the point's projection; infinite for a point not in front of the camera.
double SquaredError(const Pinhole& pinhole, const Eigen::Vector3d& point_cam,
                    const Eigen::Vector2d& px) {
  if (!InFrontOfCamera(point_cam)) return std::numeric_limits<double>::infinity();
  return (pinhole.Project(point_cam) - px).squaredNorm();
}

/// A parallax that is no more may be a pixel's noise.
double NoiseRad(const TwoViewProblem& problem) {
  return problem.options.max_error_px / std::sqrt(problem.pinhole.fx * problem.pinhole.fy);
}

/// Fills valid, valid_count, support and median_parallax_deg from the pose and the points.
void Validate(const TwoViewProblem& problem, TwoViewSolution* solution) {
  const Eigen::Vector3d centre_b = solution->b_from_a.InverseTranslation();
  const double max_squared = problem.options.max_error_px * problem.options.max_error_px;
  std::vector<double> parallaxes;
  solution->valid.assign(problem.pairs.size(), 0);
  solution->support = 0;
  solution->valid_count = 0;
  for (size_t i = 0; i < problem.pairs.size(); ++i) {
    const Eigen::Vector3d& point = solution->points_a[i];
    const PixelPair& pair = problem.pairs[i];
    const double in_a = SquaredError(problem.pinhole, point, pair.a_px);
    const double in_b = SquaredError(problem.pinhole, solution->b_from_a * point, pair.b_px);
    if (!(in_a <= max_squared && in_b <= max_squared)) continue;
    solution->valid[i] = 1;
    solution->support += 1 - (in_a + in_b) / (2 * max_squared);
    ++solution->valid_count;
    parallaxes.push_back(ParallaxAngle(Eigen::Vector3d::Zero(), centre_b, point));
  }
  solution->median_parallax_deg = parallaxes.empty() ? 0 : Median(parallaxes) / kRadiansPerDegree;
}

/// The point that two rays show. Of what is too far away for any parallax, noise decides whether
/// the rays meet in front of the cameras or behind: it is put far away in front.
Eigen::Vector3d PointOf(const TwoViewProblem& problem, const SE3& b_from_a, const PixelPair& pair) {
  const Eigen::Vector3d ray_a = problem.pinhole.Unproject(pair.a_px);
  const Eigen::Vector3d ray_b = problem.pinhole.Unproject(pair.b_px);
  const auto point = TriangulatePoint(SE3(), ray_a, b_from_a, ray_b);
  if (point && InFrontOfCamera(*point) && InFrontOfCamera(b_from_a * *point)) return *point;
  const double far_away = problem.pinhole.fx / (kFarParallax * problem.options.max_error_px);
  return far_away *
         (ray_a.normalized() + b_from_a.rotation().conjugate() * ray_b.normalized()).normalized();
}

/// Triangulates the pairs that have no valid point.
void Triangulate(const TwoViewProblem& problem, TwoViewSolution* solution) {
  solution->points_a.resize(problem.pairs.size());
  solution->valid.resize(problem.pairs.size(), 0);
  for (size_t i = 0; i < problem.pairs.size(); ++i) {
    if (solution->valid[i]) continue;
    const PixelPair& pair = problem.pairs[i];
    solution->points_a[i].setZero();
    if (!Finite(pair)) continue;
    solution->points_a[i] = PointOf(problem, solution->b_from_a, pair);
  }
  Validate(problem, solution);
}

/// Most of the model's inliers lie in front of both cameras. Points so far that the noise of a
/// pixel decides on which side they are do not vote.
bool MostInFront(const TwoViewProblem& problem, const TwoViewModel& model,
                 const TwoViewSolution& solution) {
  const Eigen::Matrix3d b_rotation_a = solution.b_from_a.RotationMatrix();
  int voters = 0, in_front = 0;
  for (size_t i = 0; i < problem.pairs.size(); ++i) {
    if (!model.inlier[i]) continue;
    const Eigen::Vector3d ray_a =
        (b_rotation_a * problem.pinhole.Unproject(problem.pairs[i].a_px)).normalized();
    const Eigen::Vector3d ray_b = problem.pinhole.Unproject(problem.pairs[i].b_px).normalized();
    if (ray_a.cross(ray_b).norm() <= NoiseRad(problem)) continue;
    ++voters;
    const Eigen::Vector3d& point = solution.points_a[i];
    in_front += InFrontOfCamera(point) && InFrontOfCamera(solution.b_from_a * point);
  }
  return in_front > 0 && in_front >= problem.options.min_front_ratio * voters;
}

int InlierCount(const std::optional<TwoViewModel>& model) {
  if (!model) return 0;
  return static_cast<int>(std::count(model->inlier.begin(), model->inlier.end(), 1));
}

/// Whether the homography explains enough of the pairs for its poses to be tried.
bool IsShallow(const std::optional<TwoViewModel>& homography,
               const std::optional<TwoViewModel>& essential, const TwoViewOptions& options) {
  if (!homography) return false;
  const double both = homography->score + (essential ? essential->score : 0);
  return homography->score >= options.min_homography_share * both;
}

bool HasSupport(const TwoViewProblem& problem, const TwoViewSolution& solution) {
  return solution.valid_count >= problem.options.min_inliers;
}

/// Fills certain and certain_count, for pixels that are good to `sigma_px` where detected.
void JudgeDistances(const TwoViewProblem& problem, double sigma_px, TwoViewSolution* solution) {
  solution->sigma_px = sigma_px;
  solution->certain.clear();
  for (double sigma : RelativeDistanceSigmas(problem.pinhole, problem.pairs, *solution, sigma_px)) {
    solution->certain.push_back(sigma <= problem.options.max_distance_sigma);
  }
  solution->certain_count =
      static_cast<int>(std::count(solution->certain.begin(), solution->certain.end(), 1));
}

double ParallaxDeg(const TwoViewSolution& solution, size_t pair) {
  const Eigen::Vector3d centre_b = solution.b_from_a.InverseTranslation();
  return ParallaxAngle(Eigen::Vector3d::Zero(), centre_b, solution.points_a[pair]) /
         kRadiansPerDegree;
}

/// Cars that drive past a camera that hovers show the motion of one among far things: what stands
/// about them shows no parallax then, and not all that moves fits.
bool MayBeOfMovingThings(const TwoViewProblem& problem, const TwoViewSolution& solution) {
  const auto pairs = static_cast<double>(problem.pairs.size());
  if (solution.valid_count >= problem.options.min_undisputed_ratio * pairs) return false;
  int moved = 0;
  for (size_t i = 0; i < problem.pairs.size(); ++i) {
    moved += solution.valid[i] && ParallaxDeg(solution, i) * kRadiansPerDegree > NoiseRad(problem);
  }
  return moved < problem.options.min_moved_ratio * solution.valid_count;
}

bool HasParallax(const TwoViewProblem& problem, const TwoViewSolution& solution) {
  return solution.median_parallax_deg >= problem.options.min_parallax_deg &&
         solution.certain_count >= problem.options.min_certain &&
         solution.valid_count >=
             problem.options.min_valid_ratio * static_cast<double>(problem.pairs.size()) &&
         !MayBeOfMovingThings(problem, solution);
}

/// Maximum-likelihood pose and points from the valid pairs up to a parallax; the baseline is
/// brought back to length 1.
void Adjust(const TwoViewProblem& problem, double max_parallax_deg, TwoViewSolution* solution) {
  BundleOptions bundle_options;
  bundle_options.max_iterations = 30;
  bundle_options.min_relative_decrease = 1e-6;
  BundleProblem bundle;
  bundle.pinhole = problem.pinhole;
  bundle.cam_from_world = {SE3(), solution->b_from_a};
  bundle.camera_fixed = {1, 0};
  const double sigma_px = problem.options.max_error_px / std::sqrt(bundle_options.chi_square);
  std::vector<size_t> pair_of_landmark;
  for (size_t i = 0; i < problem.pairs.size(); ++i) {
    if (!solution->valid[i] || ParallaxDeg(*solution, i) > max_parallax_deg) continue;
    const int landmark = static_cast<int>(pair_of_landmark.size());
    pair_of_landmark.push_back(i);
    bundle.landmarks_world.push_back(solution->points_a[i]);
    const PixelPair& pair = problem.pairs[i];
    bundle.observations.push_back({0, landmark, pair.a_px, sigma_px * pair.noise_ratio});
    bundle.observations.push_back({1, landmark, pair.b_px, sigma_px * pair.noise_ratio});
  }
  AdjustBundle(&bundle, bundle_options);

  const SE3& b_from_a = bundle.cam_from_world[1];
  const double baseline = b_from_a.translation().norm();
  if (!(baseline > 0)) return;
  solution->b_from_a = SE3(b_from_a.rotation(), b_from_a.translation() / baseline);
  for (size_t landmark = 0; landmark < pair_of_landmark.size(); ++landmark) {
    solution->points_a[pair_of_landmark[landmark]] = bundle.landmarks_world[landmark] / baseline;
  }
  Validate(problem, solution);
}

/// Adds the poses of a model that its points allow.
void AddSolutions(const TwoViewProblem& problem, const TwoViewModel& model,
                  std::vector<TwoViewSolution>* solutions) {
  for (const SE3& b_from_a : model.b_from_a) {
    TwoViewSolution solution;
    solution.b_from_a = b_from_a;
    Triangulate(problem, &solution);
    if (!MostInFront(problem, model, solution) || !HasSupport(problem, solution)) continue;
    // The residuals of a pose that is not refined yet are its own, not the pixels'.
    JudgeDistances(problem, problem.options.min_sigma_px, &solution);
    solutions->push_back(solution);
  }
}

/// Median over the valid points that show more than noise does: what is far away says nothing of
/// how near the rest is.
double VisibleParallaxDeg(const TwoViewProblem& problem, const TwoViewSolution& solution) {
  std::vector<double> visible;
  for (size_t i = 0; i < problem.pairs.size(); ++i) {
    if (!solution.valid[i]) continue;
    const double parallax_deg = ParallaxDeg(solution, i);
    if (parallax_deg > NoiseRad(problem) / kRadiansPerDegree) visible.push_back(parallax_deg);
  }
  return visible.empty() ? 0 : Median(visible);
}

/// First without the nearest points: a wrong match that meets its epipolar line by chance mostly
/// triangulates close to the cameras, where it has the leverage to hold the pose in a false
/// minimum. From the better pose it no longer fits.
void Refine(const TwoViewProblem& problem, TwoViewSolution* solution) {
  Adjust(problem, kHighParallaxRatio * VisibleParallaxDeg(problem, *solution), solution);
  Triangulate(problem, solution);
  Adjust(problem, std::numeric_limits<double>::infinity(), solution);
  Triangulate(problem, solution);
  const double sigma_px =
      EpipolarSigmaPx(problem.pinhole, problem.pairs, *solution, problem.options.min_sigma_px);
  JudgeDistances(problem, sigma_px, solution);
}

/// Homography and essential matrix may lead to the same pose.
bool SamePose(const TwoViewSolution& a, const TwoViewSolution& b) {
  const SE3& first = a.b_from_a;
  const SE3& second = b.b_from_a;
  return first.rotation().angularDistance(second.rotation()) < kSamePoseRad &&
         ParallaxAngle(first.translation(), second.translation(), Eigen::Vector3d::Zero()) <
             kSamePoseRad;
}

/// By falling support: the best, and those as different from it as planar ambiguity makes them and
/// supported nearly as well, kMaxSolutions in all. None if the best has too little parallax:
/// another that has more must not win for that.
std::vector<TwoViewSolution> Choose(const TwoViewProblem& problem,
                                    std::vector<TwoViewSolution> solutions) {
  std::erase_if(solutions,
                [&](const TwoViewSolution& solution) { return !HasSupport(problem, solution); });
  // Not std::stable_sort: libstdc++ does not align its buffer for the SE3 of a solution.
  std::sort(
      solutions.begin(), solutions.end(),
      [](const TwoViewSolution& a, const TwoViewSolution& b) { return a.support > b.support; });
  std::vector<TwoViewSolution> chosen;
  if (solutions.empty() || !HasParallax(problem, solutions.front())) return chosen;
  for (TwoViewSolution& solution : solutions) {
    if (chosen.size() == kMaxSolutions) break;
    const auto same = [&](const TwoViewSolution& other) { return SamePose(solution, other); };
    if (std::any_of(chosen.begin(), chosen.end(), same)) continue;
    const double best = chosen.empty() ? 0 : chosen.front().valid_count;
    if (solution.valid_count >= problem.options.min_support_ratio * best)
      chosen.push_back(std::move(solution));
  }
  return chosen;
}

}  // namespace

void TwoViewOptions::Check() const { CheckOptions("", *this); }

std::optional<TwoViewResult> EstimateTwoView(const Pinhole& pinhole,
                                             const std::vector<PixelPair>& pairs, uint64_t seed,
                                             const TwoViewOptions& options, int* agreeing) {
  options.Check();
  if (agreeing) *agreeing = 0;
  const auto finite = std::count_if(pairs.begin(), pairs.end(), Finite);
  if (finite < options.min_inliers) return std::nullopt;
  const auto homography = EstimateHomography(pinhole, pairs, seed, options);
  const auto essential = EstimateEssential(pinhole, pairs, seed, options);

  if (agreeing) *agreeing = std::max(InlierCount(homography), InlierCount(essential));
  TwoViewResult result;
  const TwoViewProblem problem{pinhole, pairs, options};
  std::vector<TwoViewSolution> solutions;
  if (IsShallow(homography, essential, options)) AddSolutions(problem, *homography, &solutions);
  if (essential) AddSolutions(problem, *essential, &solutions);
  const auto has_parallax = [&](const TwoViewSolution& s) { return HasParallax(problem, s); };
  if (std::none_of(solutions.begin(), solutions.end(), has_parallax)) return std::nullopt;
  for (TwoViewSolution& solution : solutions) Refine(problem, &solution);
  result.solutions = Choose(problem, std::move(solutions));
  if (result.solutions.empty()) return std::nullopt;
  return result;
}

}  // namespace deepuav
