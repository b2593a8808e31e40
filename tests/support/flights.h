#pragma once

#include <cmath>

#include "deepuav/base/random.h"
#include "deepuav/geometry/timed_pose.h"

namespace deepuav {

inline Timestamp AtSeconds(double seconds) {
  return {static_cast<int64_t>(std::llround(seconds * 1e9))};
}

/// A winding flight with turns about all axes, `rate_hz` poses a second from `start_s` on.
inline Trajectory MakeFlight(int poses, double rate_hz, double start_s = 0) {
  Trajectory flight;
  for (int i = 0; i < poses; ++i) {
    const double t = i / rate_hz;
    const Eigen::Vector3d position(6 * std::sin(0.5 * t), 4 * std::sin(0.8 * t + 1),
                                   2 + 0.5 * std::sin(1.3 * t));
    const Eigen::Vector3d turn(0.2 * std::sin(t), 0.3 * std::sin(0.7 * t), 0.9 * std::sin(0.4 * t));
    flight.push_back({AtSeconds(start_s + t), SE3(RotationExp(turn), position)});
  }
  return flight;
}

inline Trajectory AddNoise(Trajectory trajectory, double sigma_m, Random& random) {
  for (TimedPose& pose : trajectory) {
    Eigen::Vector3d noise;
    for (double& value : noise) value = random.Gaussian(sigma_m);
    pose.world_from_cam =
        SE3(pose.world_from_cam.rotation(), pose.world_from_cam.translation() + noise);
  }
  return trajectory;
}

}  // namespace deepuav
