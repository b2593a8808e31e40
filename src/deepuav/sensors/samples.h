#pragma once

#include <Eigen/Core>

#include "deepuav/base/time.h"

namespace deepuav {

/// What an inertial sensor measures, in its own frame.
struct ImuSample {
  Timestamp time;
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();    ///< m/s^2: acceleration less gravity
};

/// A position fix of WGS 84, with the standard deviations that the receiver states.
struct GnssSample {
  Timestamp time;
  double latitude_deg = 0, longitude_deg = 0;
  double altitude_m = 0;                              ///< Above the ellipsoid.
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Zero();  ///< East, north, up.
};

struct BarometerSample {
  Timestamp time;
  double pressure_pa = 0;
  double altitude_m = 0;  ///< Of that pressure in the standard atmosphere.
};

}  // namespace deepuav
