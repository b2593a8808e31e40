#pragma once

#include <vector>

#include "deepuav/geometry/timed_pose.h"
#include "deepuav/inertial/chain/inertial_adjustment.h"

namespace deepuav {

/// Two poses and what was integrated between them.
struct PathStep {
  const TimedPose *first, *last;
  Preintegration motion;
};

/// The path cut where `step_s` have passed; steps that poses are missing in for more than
/// `max_gap_s` or samples at all are left out. They point into the path.
inline std::vector<PathStep> StepsAlong(const Trajectory& path, const ImuIntegrator& imu,
                                        double step_s, double max_gap_s, double clock_offset_s,
                                        const ImuBias& bias) {
  std::vector<PathStep> steps;
  size_t first = 0;
  for (size_t k = 1; k < path.size(); ++k) {
    const TimedPose &from = path[first], &to = path[k];
    const double seconds = SecondsBetween(from.time, to.time);
    if (seconds < step_s) continue;
    first = k;
    if (seconds > step_s + max_gap_s) continue;
    const auto motion = imu.Between(OnSensorClock(from.time, clock_offset_s),
                                    OnSensorClock(to.time, clock_offset_s), bias);
    if (motion) steps.push_back({&from, &to, *motion});
  }
  return steps;
}

}  // namespace deepuav
