#include "deepuav/evaluation/evaluation.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/base/options.h"

namespace deepuav {
namespace {

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

}  // namespace

void EvaluationOptions::Check() const {
  association.Check();
  rpe.Check();
  CheckOption(std::isfinite(start_s) && start_s >= 0, "start_s", start_s, "0 s or more");
  CheckOption(end_s > start_s, "end_s", end_s, "more than start_s");
}

double Evaluation::Completeness() const {
  std::set<Timestamp> found;
  for (const TimedPose& pose : matched_truth) found.insert(pose.time);
  return truth.empty() ? 0 : static_cast<double>(found.size()) / static_cast<double>(truth.size());
}

Evaluation EvaluateTrajectory(const Truth& truth, const Trajectory& estimate,
                              const EvaluationOptions& options) {
  options.Check();
  if (truth.trajectory.empty()) throw Error("The truth has no poses");
  if (estimate.empty()) throw Error("The estimate has no poses");
  Evaluation evaluation;
  evaluation.truth = truth.trajectory;
  Trajectory part_of_estimate = estimate;
  if (!IsWhole(options)) {
    const Timestamp origin = truth.trajectory.front().time;
    const double margin_s = options.association.max_difference_s;
    evaluation.truth = PartOf(truth.trajectory, origin, 0, options.start_s, options.end_s);
    part_of_estimate = PartOf(estimate, origin, options.association.time_offset_s,
                              options.start_s - margin_s, options.end_s + margin_s);
    if (evaluation.truth.empty() || part_of_estimate.empty()) {
      throw Error("Between {} s and {} s there are {} poses of the truth and {} of the estimate",
                  options.start_s, options.end_s, evaluation.truth.size(), part_of_estimate.size());
    }
  }
  evaluation.estimate_poses = static_cast<int>(part_of_estimate.size());

  const std::vector<AssociatedPair> pairs =
      Associate(evaluation.truth, part_of_estimate, options.association);
  evaluation.shared_poses = CountSharedPoses(pairs);
  for (const AssociatedPair& pair : pairs) {
    evaluation.matched_truth.push_back(evaluation.truth[pair.truth]);
    evaluation.matched_estimate.push_back(part_of_estimate[pair.estimate]);
  }

  evaluation.ate = ComputeAbsoluteError(evaluation.matched_truth, evaluation.matched_estimate,
                                        options.alignment, options.horizontal);
  evaluation.matched_estimate =
      MoveTrajectory(evaluation.ate.truth_from_estimate, evaluation.matched_estimate);
  evaluation.rpe =
      truth.has_orientation
          ? ComputeRelativeError(evaluation.matched_truth, evaluation.matched_estimate, options.rpe)
          : ComputeRelativeDistanceError(evaluation.matched_truth, evaluation.matched_estimate,
                                         options.rpe, options.horizontal);
  return evaluation;
}

}  // namespace deepuav
