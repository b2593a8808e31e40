#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "deepuav/base/time.h"

namespace deepuav {

/// What an inertial sensor measures, in its own frame.
struct ImuSample {
  Timestamp time;
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();    ///< m/s^2: acceleration less gravity
};

/// A position fix: WGS 84, with the standard deviations that the receiver states.
struct GnssFix {
  Timestamp time;
  double latitude_deg = 0, longitude_deg = 0;
  std::optional<double> altitude_m;  ///< Above the ellipsoid or the sea, as the source has it.
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Zero();  ///< East, north, up; 0: not stated.
};

/// How the camera was turned when it took an image, by the sensors of what carries it.
struct AttitudeSample {
  Timestamp time;                                                    ///< Of the image.
  Eigen::Quaterniond enu_from_cam = Eigen::Quaterniond::Identity();  ///< East, north, up.
};

struct BarometerSample {
  Timestamp time;
  double pressure_pa = 0;
  double altitude_m = 0;  ///< Of that pressure in the standard atmosphere.
};

}  // namespace deepuav
