#pragma once

#include <cstdint>

#include "deepuav/autopilot/body_pose.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

using Matrix15d = Eigen::Matrix<double, 15, 15>;

/// What a body's inertial sensor errs by, vibration of the vehicle included.
struct InertialErrors {
  double gyroscope_density = 0.01;             ///< rad/s/sqrt(Hz)
  double accelerometer_density = 0.1;          ///< m/s^2/sqrt(Hz)
  double gyroscope_walk = 0.002;               ///< rad/s^2/sqrt(Hz)
  double accelerometer_walk = 0.05;            ///< m/s^3/sqrt(Hz): a level that is off turns, too.
  double turn_rate_sigma_rad_s = 0.05;         ///< Of a single sample.
  double gyroscope_bias_sigma_rad_s = 0.05;    ///< Before poses tell it...
  double accelerometer_bias_sigma_m_s2 = 0.5;  ///< ...a level that is a little off included.
};

/// How a body moves by its inertial sensor, and the sensor's biases: an error-state Kalman filter
/// (Sola, Quaternion kinematics for the error-state Kalman filter, 2017, section 5). Local frame: z
/// down. A value.
struct InertialFilter {
  /// Where the errors are in the covariance, three each: position in the local axes, rotation
  /// vector in the body's, velocity, and both biases.
  static constexpr int kPosition = 0, kRotation = 3, kVelocity = 6, kGyroscope = 9,
                       kAccelerometer = 12;

  int64_t time_ns = 0;
  SE3 local_from_body;
  Eigen::Vector3d velocity_local = Eigen::Vector3d::Zero();      ///< m/s
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();      ///< rad/s
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();  ///< m/s^2
  Matrix15d covariance = Matrix15d::Identity();
};

/// Goes on until a time with what the sensor measures meanwhile, which is taken as constant.
void Integrate(const ImuSample& sample, int64_t until_ns, const InertialErrors& errors,
               InertialFilter* filter);

/// Takes a pose of its time. `noise`: as of NoiseOf.
void Correct(const SE3& local_from_body, const Matrix6d& noise, InertialFilter* filter);

/// The local frame moved so that the body is at this pose: its own motion stays what it is.
void MoveFrame(const SE3& local_from_body, const Matrix6d& noise, InertialFilter* filter);

}  // namespace deepuav
