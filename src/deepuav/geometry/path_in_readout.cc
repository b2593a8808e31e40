#include "deepuav/geometry/path_in_readout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace deepuav {
namespace {

/// Poses on the one side where there are none on the other: a parabola with the pose itself.
constexpr int kReachAtAnEnd = 2;

/// Value, first and second derivative.
using Derivatives = std::array<double, 3>;

/// What values at some moments, in seconds from now, count for the derivatives now of the
/// polynomial through them (Fornberg 1988, Generation of Finite Difference Formulas on Arbitrarily
/// Spaced Grids, equations 3.8 and 3.9).
std::vector<Derivatives> WeightsNow(const std::vector<double>& moments) {
  std::vector<Derivatives> weights(moments.size(), {0, 0, 0});
  weights[0][0] = 1;
  const auto lower = [](const Derivatives& of, size_t order) {
    return order > 0 ? static_cast<double>(order) * of[order - 1] : 0;
  };
  double product_before = 1;
  for (size_t i = 1; i < moments.size(); ++i) {
    const Derivatives last = weights[i - 1];
    double product = 1;
    for (size_t j = 0; j < i; ++j) {
      const double apart = moments[i] - moments[j];
      product *= apart;
      for (size_t order = last.size(); order-- > 0;)
        weights[j][order] = (moments[i] * weights[j][order] - lower(weights[j], order)) / apart;
    }
    for (size_t order = 0; order < last.size(); ++order)
      weights[i][order] =
          product_before / product * (lower(last, order) - moments[i - 1] * last[order]);
    product_before = product;
  }
  return weights;
}

/// How many poses, one after another from `at` on, follow without a gap.
int Reach(const Trajectory& path, size_t at, int step, const PathInReadoutOptions& options) {
  int reach = 0;
  for (auto i = static_cast<ptrdiff_t>(at); reach < options.reach; ++reach, i += step) {
    const ptrdiff_t next = i + step;
    if (next < 0 || next >= std::ssize(path)) break;
    const double step_s = std::abs(
        SecondsBetween(path[static_cast<size_t>(i)].time, path[static_cast<size_t>(next)].time));
    if (step_s == 0 || step_s > options.max_step_s) break;
  }
  return reach;
}

/// The poses about one, seen from it.
struct Neighbourhood {
  std::vector<double> moments_s;
  std::vector<SE3> now_from_then;
};

/// Which they are: as many before as after, but at either end of a path.
struct Range {
  int before = 0, after = 0;
};

Range RangeAbout(const Trajectory& path, size_t at, const PathInReadoutOptions& options) {
  const Range range{Reach(path, at, -1, options), Reach(path, at, +1, options)};
  const int most = std::max(std::min(range.before, range.after), kReachAtAnEnd);
  return {std::min(range.before, most), std::min(range.after, most)};
}

Neighbourhood About(const Trajectory& path, size_t at, const Range& range, bool with_itself) {
  const SE3 now_from_world = path[at].world_from_cam.Inverse();
  Neighbourhood about;
  const auto middle = static_cast<ptrdiff_t>(at);
  for (ptrdiff_t k = middle - range.before; k <= middle + range.after; ++k) {
    if (k == middle && !with_itself) continue;
    const auto i = static_cast<size_t>(k);
    about.moments_s.push_back(SecondsBetween(path[at].time, path[i].time));
    about.now_from_then.push_back(now_from_world * path[i].world_from_cam);
  }
  return about;
}

Eigen::Vector3d Turn(const SE3& pose) { return pose.Log().tail<3>(); }

}  // namespace

std::optional<ReadoutMotion> MotionOnPath(const Trajectory& path, size_t at, double readout_s,
                                          const PathInReadoutOptions& options) {
  const Range range = RangeAbout(path, at, options);
  if (range.before + range.after < kReachAtAnEnd) return std::nullopt;
  const Neighbourhood about = About(path, at, range, true);
  const std::vector<Derivatives> weights = WeightsNow(about.moments_s);
  ReadoutMotion motion;
  for (size_t i = 0; i < weights.size(); ++i) {
    const SE3& now_from_then = about.now_from_then[i];
    const auto [value, first, second] = weights[i];
    motion.turn_rad += readout_s * first * Turn(now_from_then);
    motion.bend_rad += readout_s * readout_s / 2 * second * Turn(now_from_then);
    motion.travel += readout_s * first * now_from_then.translation();
  }
  return motion;
}

std::optional<MissedTurns> TurnsMissed(const Trajectory& path,
                                       const PathInReadoutOptions& options) {
  double missed = 0, stepped = 0;
  int poses = 0;
  for (size_t at = 0; at < path.size(); ++at) {
    const Range range = RangeAbout(path, at, options);
    if (range.before == 0 || range.after == 0) continue;
    const Neighbourhood about = About(path, at, range, false);
    const std::vector<Derivatives> weights = WeightsNow(about.moments_s);
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < weights.size(); ++i)
      turn += weights[i][0] * Turn(about.now_from_then[i]);
    missed += turn.squaredNorm();
    stepped += Turn(path[at].world_from_cam.Inverse() * path[at - 1].world_from_cam).squaredNorm();
    ++poses;
  }
  if (poses == 0) return std::nullopt;
  return MissedTurns{std::sqrt(missed / poses), std::sqrt(stepped / poses)};
}

}  // namespace deepuav
