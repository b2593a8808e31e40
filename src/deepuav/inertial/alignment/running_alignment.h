#pragma once

#include <optional>
#include <string>

#include "deepuav/inertial/alignment/inertial_alignment.h"
#include "deepuav/inertial/chain/imu_window.h"

namespace deepuav {

/// What a map's world is in metres, z up, while it still grows. The map's own origin is the
/// origin, and the camera that was there looks along x (InertialAlignment::level_from_world).
struct MetricWorld {
  Sim3 metric_from_world;
  double scale_sigma = 0;  ///< As a share of the scale.
  double tilt_sigma_rad = 0;
};

/// Finds scale and level while a camera flies, from the latest part of its path. What was told once
/// stays until what is found later is surer or contradicts it, so that the world does not shake.
/// Thread-compatible.
class RunningAlignment {
 public:
  /// `imu` must outlive it.
  RunningAlignment(const ImuWindow& imu, const InertialOptions& options);

  /// For how long a window must keep samples for poses that are up to so much older than them.
  static double KeepSeconds(const InertialOptions& options, double most_behind_s);

  /// The next pose. Says what is new, if anything; takes its time then, and when it looked in vain.
  std::optional<MetricWorld> Add(const TimedPose& pose);
  /// What comes is in another world, or the world was bent.
  void Restart();

  const std::optional<MetricWorld>& told() const { return told_; }
  /// Why the latest try found nothing, for a person; empty where it did, or none was made.
  const std::string& refusal() const { return refusal_; }

 private:
  bool IsNews(const MetricWorld& found) const;

  const ImuWindow& imu_;
  InertialOptions options_;
  Trajectory path_;                    ///< The latest part.
  std::optional<Timestamp> tried_at_;  ///< When it looked last...
  double wait_s_;                      ///< ...and for how long it waits from then on.
  std::optional<MetricWorld> told_;
  std::string refusal_;
};

}  // namespace deepuav
