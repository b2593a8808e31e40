#include "deepuav/evaluation/measures/time_offset.h"

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <limits>
#include <optional>

#include "deepuav/base/error.h"
#include "deepuav/sensors/lever_arm.h"

namespace deepuav {
namespace {

constexpr double kFinestGrid_s = 0.02;
constexpr int kMostGridSteps = 2000;
constexpr double kFewestMomentsRatio = 0.5;
constexpr int kBrentBits = 26;  // Half of a double's: no minimum can be told more exactly.

struct Agreement {
  /// Share of the truth's extent that the estimate leaves unexplained: an error in metres would be
  /// least where the truth rests and the estimate is shrunk to a point.
  double unexplained = std::numeric_limits<double>::infinity();
  size_t moments = 0;
};

double SquaredLength(const Eigen::Vector3d& v, bool horizontal) {
  return horizontal ? v.head<2>().squaredNorm() : v.squaredNorm();
}

double Unexplained(const Trajectory& truth, const Trajectory& moved, bool horizontal) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const TimedPose& pose : truth)
    mean += pose.world_from_cam.translation() / static_cast<double>(truth.size());
  double error = 0, extent = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    const Eigen::Vector3d& there = truth[i].world_from_cam.translation();
    error += SquaredLength(moved[i].world_from_cam.translation() - there, horizontal);
    extent += SquaredLength(there - mean, horizontal);
  }
  return extent > 0 ? std::sqrt(error / extent) : std::numeric_limits<double>::infinity();
}

/// Nothing left to compare, or not to be aligned, is no agreement.
Agreement AgreementAt(double offset_s, const Truth& truth, const Trajectory& estimate,
                      const EvaluationOptions& options) {
  AssociationOptions association = options.association;
  association.time_offset_s = offset_s;
  InterpolatedPairs matched;
  try {
    matched = InterpolateDenser(truth.trajectory, estimate, association);
  } catch (const Error&) {
    return {};
  }
  const Eigen::Vector3d antenna = AntennaOf(truth, options);
  Sim3 truth_from_estimate;
  if (options.alignment) {
    const auto aligned =
        AlignWithLeverArm(matched.truth, matched.estimate, *options.alignment, antenna);
    if (!aligned) return {};
    truth_from_estimate = *aligned;
  }
  const Trajectory moved = MoveToAntenna(truth_from_estimate, matched.estimate, antenna);
  return {Unexplained(matched.truth, moved, options.horizontal || !truth.has_altitude),
          matched.truth.size()};
}

struct OffsetRange {
  double low_s = 0, high_s = 0;

  double centre_s() const { return (low_s + high_s) / 2; }
  double half_s() const { return (high_s - low_s) / 2; }
};

/// The offsets to be tried: of those asked for the ones under which the two overlap in time, as a
/// grid over all of a long range would step over them.
OffsetRange RangeToTry(const Trajectory& truth, const Trajectory& estimate,
                       const EvaluationOptions& options) {
  const double asked_s = options.association.time_offset_s, range_s = options.search_offset_s;
  return {std::max(asked_s - range_s, SecondsBetween(estimate.back().time, truth.front().time)),
          std::min(asked_s + range_s, SecondsBetween(estimate.front().time, truth.back().time))};
}

/// The index of the best, -1 where there is none; `fewest`: moments that it must have.
int BestOf(const std::vector<Agreement>& grid, size_t fewest) {
  int best = -1;
  for (int i = 0; i < static_cast<int>(grid.size()); ++i) {
    if (grid[i].moments < fewest || std::isinf(grid[i].unexplained)) continue;
    if (best < 0 || grid[i].unexplained < grid[best].unexplained) best = i;
  }
  return best;
}

}  // namespace

double SearchTimeOffset(const Truth& truth, const Trajectory& estimate,
                        const EvaluationOptions& options) {
  const double asked_s = options.association.time_offset_s, range_s = options.search_offset_s;
  const OffsetRange range = RangeToTry(truth.trajectory, estimate, options);
  const int steps_a_side = std::clamp(static_cast<int>(std::ceil(range.half_s() / kFinestGrid_s)),
                                      2, kMostGridSteps / 2);
  const double step_s = range.half_s() / steps_a_side;
  const auto offset_at = [&](int step) { return range.centre_s() + step * step_s; };

  std::vector<Agreement> grid;
  size_t most_moments = 0;
  for (int step = -steps_a_side; step <= steps_a_side && range.half_s() >= 0; ++step) {
    grid.push_back(AgreementAt(offset_at(step), truth, estimate, options));
    most_moments = std::max(most_moments, grid.back().moments);
  }
  const int best = BestOf(grid, static_cast<size_t>(std::ceil(kFewestMomentsRatio *
                                                              static_cast<double>(most_moments))));
  if (best < 0) {
    throw Error("With no time offset within {} s of {} s can the estimate be aligned to the truth",
                range_s, asked_s);
  }
  const double best_s = offset_at(best - steps_a_side);
  if (best == 0 || best + 1 == static_cast<int>(grid.size())) {
    throw Error(
        "The best time offset, {:.3f} s, lies at the end of the range searched: expected one "
        "within {} s of {} s",
        best_s, range_s, asked_s);
  }
  // Brent's tolerance is relative: of the distance from the grid's best, not of a large offset.
  const auto unexplained = [&](double from_best_s) {
    return AgreementAt(best_s + from_best_s, truth, estimate, options).unexplained;
  };
  const auto [from_best_s, least] =
      boost::math::tools::brent_find_minima(unexplained, -step_s, step_s, kBrentBits);
  return least <= grid[best].unexplained ? best_s + from_best_s : best_s;
}

}  // namespace deepuav
