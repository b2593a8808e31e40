#include "deepuav/evaluation/measures/evaluation.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/base/intervals.h"
#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
#include "deepuav/evaluation/measures/time_offset.h"
#include "deepuav/sensors/lever_arm.h"

namespace deepuav {
namespace {

constexpr double kNoticedHeightShare = 0.01;

/// The poses with `start_s` <= time + offset_s - origin <= `end_s`.
Trajectory PartOf(const Trajectory& trajectory, Timestamp origin, double offset_s, double start_s,
                  double end_s) {
  Trajectory part;
  for (const TimedPose& pose : trajectory) {
    const double seconds = SecondsBetween(origin, pose.time) + offset_s;
    if (seconds >= start_s && seconds <= end_s) part.push_back(pose);
  }
  return part;
}

bool IsWhole(const EvaluationOptions& options) {
  return options.start_s <= 0 && std::isinf(options.end_s);
}

/// The part of the truth asked for, into `part_of_truth`, and that of the estimate.
Trajectory SelectPart(const Trajectory& truth, const Trajectory& estimate,
                      const EvaluationOptions& options, const AssociationOptions& association,
                      Trajectory* part_of_truth) {
  *part_of_truth = truth;
  if (IsWhole(options)) return estimate;
  const Timestamp origin = truth.front().time;
  const double margin_s =
      association.interpolate ? association.max_gap_s : association.max_difference_s;
  *part_of_truth = PartOf(truth, origin, 0, options.start_s, options.end_s);
  Trajectory part = PartOf(estimate, origin, association.time_offset_s, options.start_s - margin_s,
                           options.end_s + margin_s);
  if (part_of_truth->empty() || part.empty()) {
    throw Error("Between {} s and {} s there are {} poses of the truth and {} of the estimate",
                options.start_s, options.end_s, part_of_truth->size(), part.size());
  }
  return part;
}

/// Of positions about their mean, m^2.
Eigen::Vector3d Variance(const Trajectory& trajectory) {
  const auto count = static_cast<double>(trajectory.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), sum = Eigen::Vector3d::Zero();
  for (const TimedPose& pose : trajectory) mean += pose.world_from_cam.translation() / count;
  for (const TimedPose& pose : trajectory)
    sum += (pose.world_from_cam.translation() - mean).cwiseAbs2();
  return sum / count;
}

/// A truth without altitudes is flat: what the estimate climbs makes its scale too small, in
/// least squares by the heights' share of all variance.
void WarnOfHeights(const Trajectory& aligned) {
  const Eigen::Vector3d variance = Variance(aligned);
  const double share = variance.z() / std::max(variance.sum(), std::numeric_limits<double>::min());
  if (share < kNoticedHeightShare) return;
  Log().warn(
      "The truth has no altitudes and the estimate's heights vary by {:.1f} m: aligned to a flat "
      "truth, its scale may be {:.0f} % too small",
      std::sqrt(variance.z()), 100 * share);
}

/// The share of the poses that lie between two neighbours of some that no gap parts.
double ShareAmong(const Trajectory& some, const Trajectory& poses) {
  const double longest_s = kLongestInMedianIntervals * MedianInterval_s(some);
  const auto among = std::ranges::count_if(poses, [&](const TimedPose& pose) {
    const auto after = std::ranges::lower_bound(some, pose.time, {}, &TimedPose::time);
    if (after == some.end()) return false;
    if (after->time == pose.time) return true;
    return after != some.begin() && SecondsBetween((after - 1)->time, after->time) <= longest_s;
  });
  return static_cast<double>(among) / static_cast<double>(poses.size());
}

void MatchPoses(const Trajectory& estimate, const AssociationOptions& association,
                Evaluation* evaluation) {
  if (association.interpolate) {
    InterpolatedPairs matched = InterpolateDenser(evaluation->truth, estimate, association);
    evaluation->truth_is_interpolated = matched.truth_is_interpolated;
    evaluation->matched_truth = std::move(matched.truth);
    evaluation->matched_estimate = std::move(matched.estimate);
    return;
  }
  const std::vector<AssociatedPair> pairs = Associate(evaluation->truth, estimate, association);
  evaluation->shared_poses = CountSharedPoses(pairs);
  for (const AssociatedPair& pair : pairs) {
    evaluation->matched_truth.push_back(evaluation->truth[pair.truth]);
    evaluation->matched_estimate.push_back(estimate[pair.estimate]);
  }
}

}  // namespace

void EvaluationOptions::Check() const {
  CheckOptions("", *this);
  if (antenna_cam_m && !antenna_cam_m->allFinite())
    throw Error("The lever arm is not finite: expected metres");
}

void EvaluationOptions::CheckRelations() const {
  CheckOption(end_s > start_s, "end_s", end_s, "more than start_s");
}

double Evaluation::Completeness() const {
  if (truth_is_interpolated) return ShareAmong(matched_truth, truth);
  std::set<Timestamp> found;
  for (const TimedPose& pose : matched_truth) found.insert(pose.time);
  return truth.empty() ? 0 : static_cast<double>(found.size()) / static_cast<double>(truth.size());
}

double Evaluation::ComparedPathM() const {
  if (matched_truth.empty()) return 0;
  Trajectory compared;
  for (const TimedPose& pose : truth) {
    if (pose.time >= matched_truth.front().time && pose.time <= matched_truth.back().time)
      compared.push_back(pose);
  }
  return PathLengthM(compared);
}

double PathLengthM(const Trajectory& trajectory) {
  double length_m = 0;
  for (size_t i = 1; i < trajectory.size(); ++i) {
    length_m += (trajectory[i].world_from_cam.translation() -
                 trajectory[i - 1].world_from_cam.translation())
                    .norm();
  }
  return length_m;
}

Eigen::Vector3d AntennaOf(const Truth& truth, const EvaluationOptions& options) {
  return options.antenna_cam_m.value_or(truth.antenna_cam_m);
}

Evaluation EvaluateTrajectory(const Truth& truth, const Trajectory& estimate,
                              const EvaluationOptions& options) {
  options.Check();
  if (truth.trajectory.empty()) throw Error("The truth has no poses");
  if (estimate.empty()) throw Error("The estimate has no poses");
  AssociationOptions association = options.association;
  association.interpolate |= options.search_offset_s > 0 || truth.has_own_clock;
  if (options.search_offset_s > 0)
    association.time_offset_s = SearchTimeOffset(truth, estimate, options);

  Evaluation evaluation;
  evaluation.time_offset_s = association.time_offset_s;
  evaluation.interpolated = association.interpolate;
  evaluation.horizontal = options.horizontal || !truth.has_altitude;
  evaluation.z_is_up = truth.z_is_up;
  evaluation.antenna_cam_m = AntennaOf(truth, options);
  const Trajectory part_of_estimate =
      SelectPart(truth.trajectory, estimate, options, association, &evaluation.truth);
  evaluation.estimate_poses = static_cast<int>(part_of_estimate.size());
  MatchPoses(part_of_estimate, association, &evaluation);

  evaluation.ate =
      ComputeAbsoluteError(evaluation.matched_truth, evaluation.matched_estimate, options.alignment,
                           evaluation.horizontal, evaluation.antenna_cam_m);
  evaluation.matched_estimate = MoveToAntenna(
      evaluation.ate.truth_from_estimate, evaluation.matched_estimate, evaluation.antenna_cam_m);
  if (!truth.has_altitude && options.alignment) WarnOfHeights(evaluation.matched_estimate);
  evaluation.rpe =
      truth.has_orientation
          ? ComputeRelativeError(evaluation.matched_truth, evaluation.matched_estimate, options.rpe,
                                 evaluation.horizontal)
          : ComputeRelativeDistanceError(evaluation.matched_truth, evaluation.matched_estimate,
                                         options.rpe, evaluation.horizontal);
  return evaluation;
}

}  // namespace deepuav
