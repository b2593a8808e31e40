#include "deepuav/evaluation/measures/rpe.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

PosePairs PairsByFrames(int size, int delta, bool all_pairs) {
  PosePairs pairs;
  for (int i = 0; i + delta < size; i += all_pairs ? 1 : delta) pairs.emplace_back(i, i + delta);
  return pairs;
}

/// Path lengths from the first pose.
std::vector<double> PathLengths(const Trajectory& trajectory) {
  std::vector<double> lengths(trajectory.size(), 0.0);
  for (size_t i = 1; i < trajectory.size(); ++i) {
    lengths[i] = lengths[i - 1] + (trajectory[i].world_from_cam.translation() -
                                   trajectory[i - 1].world_from_cam.translation())
                                      .norm();
  }
  return lengths;
}

/// Seconds from the first pose.
std::vector<double> Seconds(const Trajectory& trajectory) {
  std::vector<double> seconds;
  for (const TimedPose& pose : trajectory) {
    seconds.push_back(SecondsBetween(trajectory.front().time, pose.time));
  }
  return seconds;
}

/// Of the values after `i`, which do not fall, the first of those nearest to values[i] + delta.
int NearestAhead(const std::vector<double>& values, int i, double delta) {
  const double target = values[i] + delta;
  const auto first = values.begin() + i + 1;
  const auto at_least = std::lower_bound(first, values.end(), target);
  if (at_least == first) return i + 1;
  const double below = *(at_least - 1);
  const bool take_above = at_least != values.end() && *at_least - target < target - below;
  const auto nearest = take_above ? at_least : std::lower_bound(first, at_least, below);
  return static_cast<int>(nearest - values.begin());
}

PosePairs PairsNearest(const std::vector<double>& values, const RpeOptions& options) {
  PosePairs pairs;
  const int size = static_cast<int>(values.size());
  for (int i = 0; i + 1 < size;) {
    const int j = NearestAhead(values, i, options.delta);
    const bool accepted = std::abs(values[j] - values[i] - options.delta) <=
                          options.relative_tolerance * options.delta;
    if (accepted) pairs.emplace_back(i, j);
    i = accepted && !options.all_pairs ? j : i + 1;
  }
  return pairs;
}

/// End to end: each pair ends at the first pose by which the path since its start is at least
/// delta.
PosePairs PairsAlongPath(const Trajectory& trajectory, double delta) {
  PosePairs pairs;
  int start = 0;
  double path = 0;
  for (int i = 1; i < static_cast<int>(trajectory.size()); ++i) {
    path += (trajectory[i].world_from_cam.translation() -
             trajectory[i - 1].world_from_cam.translation())
                .norm();
    if (path < delta) continue;
    pairs.emplace_back(start, i);
    start = i;
    path = 0;
  }
  return pairs;
}

PosePairs PairsOf(const Trajectory& truth, const Trajectory& estimate, const RpeOptions& options) {
  if (truth.size() != estimate.size()) {
    throw Error("{} poses of truth do not pair with {} of the estimate", truth.size(),
                estimate.size());
  }
  // Times are the truth's: the estimate's may be off by the time offset.
  const bool from_truth = options.pairs_from_truth || options.unit == RpeUnit::kSeconds;
  return SelectPosePairs(from_truth ? truth : estimate, options);
}

}  // namespace

void RpeOptions::Check() const { CheckOptions("rpe", *this); }

void RpeOptions::CheckRelations() const {
  if (unit == RpeUnit::kFrames)
    CheckOption(delta == std::floor(delta), "delta", delta, "a whole number of frames");
}

PosePairs SelectPosePairs(const Trajectory& trajectory, const RpeOptions& options) {
  options.Check();
  switch (options.unit) {
    case RpeUnit::kFrames:
      return PairsByFrames(static_cast<int>(trajectory.size()), static_cast<int>(options.delta),
                           options.all_pairs);
    case RpeUnit::kMetres:
      return options.all_pairs ? PairsNearest(PathLengths(trajectory), options)
                               : PairsAlongPath(trajectory, options.delta);
    case RpeUnit::kSeconds:
      return PairsNearest(Seconds(trajectory), options);
  }
  return {};
}

std::optional<RelativeError> ComputeRelativeError(const Trajectory& truth,
                                                  const Trajectory& aligned_estimate,
                                                  const RpeOptions& options, bool horizontal) {
  RelativeError result;
  result.pairs = PairsOf(truth, aligned_estimate, options);
  if (result.pairs.empty()) return std::nullopt;
  for (const auto& [i, j] : result.pairs) {
    const SE3 true_motion = truth[i].world_from_cam.Inverse() * truth[j].world_from_cam;
    const SE3 motion =
        aligned_estimate[i].world_from_cam.Inverse() * aligned_estimate[j].world_from_cam;
    const SE3 error = true_motion.Inverse() * motion;
    const Eigen::Vector3d error_m = truth[j].world_from_cam.rotation() * error.translation();
    result.errors_m.push_back(horizontal ? error_m.head<2>().norm() : error_m.norm());
    result.errors_deg.push_back(kDegreesPerRadian * error.Angle());
  }
  result.translation_m = ComputeStatistics(result.errors_m);
  result.rotation_deg = ComputeStatistics(result.errors_deg);
  return result;
}

std::optional<RelativeError> ComputeRelativeDistanceError(const Trajectory& truth,
                                                          const Trajectory& aligned_estimate,
                                                          const RpeOptions& options,
                                                          bool horizontal) {
  RelativeError result;
  result.pairs = PairsOf(truth, aligned_estimate, options);
  if (result.pairs.empty()) return std::nullopt;
  const auto distance = [horizontal](const Trajectory& trajectory, int i, int j) {
    const Eigen::Vector3d step =
        trajectory[j].world_from_cam.translation() - trajectory[i].world_from_cam.translation();
    return horizontal ? step.head<2>().norm() : step.norm();
  };
  for (const auto& [i, j] : result.pairs) {
    result.errors_m.push_back(std::abs(distance(truth, i, j) - distance(aligned_estimate, i, j)));
  }
  result.translation_m = ComputeStatistics(result.errors_m);
  return result;
}

}  // namespace deepuav
