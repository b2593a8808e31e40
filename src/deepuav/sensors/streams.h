#pragma once

#include <string>
#include <vector>

#include "deepuav/geometry/se3.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

/// The continuous noise of an inertial sensor.
struct ImuNoise {
  double gyroscope_noise_density = 0;      ///< rad/s/sqrt(Hz)
  double gyroscope_random_walk = 0;        ///< rad/s^2/sqrt(Hz)
  double accelerometer_noise_density = 0;  ///< m/s^2/sqrt(Hz)
  double accelerometer_random_walk = 0;    ///< m/s^3/sqrt(Hz)
};

struct ImuStream {
  std::string source;  ///< The file, for messages; empty where there is none.
  ImuNoise noise;      ///< 0: not stated.
  SE3 cam_from_imu;
  std::vector<ImuSample> samples;  ///< By growing time.
  bool mount_is_known = true;      ///< Else turns must tell the rotation of `cam_from_imu`.
};

struct GnssStream {
  std::string source;
  Eigen::Vector3d antenna_cam_m = Eigen::Vector3d::Zero();  ///< In the camera's axes.
  /// How far the receiver's clock may be from the camera's; 0: the fixes are the images' own.
  double clock_sigma_s = 0;
  std::vector<GnssFix> fixes;  ///< By growing time.
};

struct BarometerStream {
  std::string source;
  Eigen::Vector3d sensor_cam_m = Eigen::Vector3d::Zero();  ///< In the camera's axes.
  std::vector<BarometerSample> samples;                    ///< By growing time.
};

struct AttitudeStream {
  std::string source;
  std::vector<AttitudeSample> samples;  ///< By growing time.
};

/// What a dataset's other sensors measured, on the time stamps of its images. A sensor that is not
/// there has no samples.
struct SensorStreams {
  ImuStream imu;
  GnssStream gnss;
  BarometerStream barometer;
  AttitudeStream attitude;
};

}  // namespace deepuav
