#pragma once

#include "support/flights.h"

namespace deepuav {

/// Over some hundred metres, the camera level in the mean.
inline Trajectory Winding(double duration_s, double rate_hz) {
  Trajectory flight = MakeFlight(static_cast<int>(rate_hz * duration_s), rate_hz);
  for (TimedPose& pose : flight) {
    pose.world_from_cam = SE3(pose.world_from_cam.rotation() * RotationExp({-M_PI / 2, 0, 0}),
                              Eigen::Vector3d(10 * pose.world_from_cam.translation()));
  }
  return flight;
}

/// 4 m/s north, the camera along it and level.
inline Trajectory Straight(double duration_s, double rate_hz) {
  Trajectory flight;
  for (int i = 0; i < rate_hz * duration_s; ++i) {
    const double t = i / rate_hz;
    flight.push_back({AtSeconds(t), SE3(RotationExp({-M_PI / 2, 0, 0}), {0, 4 * t, 30})});
  }
  return flight;
}

}  // namespace deepuav
