#pragma once

#include <Eigen/Core>

#include "deepuav/geometry/se3.h"

namespace deepuav {

/// How the body moves at one instant. World: x east, y north, z up. Body: x forward, y left, z up.
struct BodyState {
  SE3 world_from_body;
  Eigen::Vector3d velocity_world = Eigen::Vector3d::Zero();         ///< m/s
  Eigen::Vector3d acceleration_world = Eigen::Vector3d::Zero();     ///< m/s^2
  Eigen::Vector3d angular_velocity_body = Eigen::Vector3d::Zero();  ///< rad/s
};

/// A body's motion as a function of time from 0 to duration_s(). Velocity, acceleration and angular
/// velocity are the exact derivatives of the pose.
class FlightPath {
 public:
  virtual ~FlightPath() = default;
  virtual double duration_s() const = 0;
  /// Times outside are taken at the nearer end.
  virtual BodyState At(double time_s) const = 0;
};

}  // namespace deepuav
