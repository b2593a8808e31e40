#pragma once

#include <cmath>
#include <vector>

#include "deepuav/base/random.h"
#include "deepuav/geometry/timed_pose.h"
#include "deepuav/sensors/streams.h"
#include "support/flights.h"

namespace deepuav {

/// The motion of an inertial sensor that is known exactly, z up.
class InertialFlight {
 public:
  static constexpr double kGravity_m_s2 = 9.80665;

  virtual ~InertialFlight() = default;
  virtual Eigen::Vector3d Position(double t) const {
    return {6 * std::sin(0.5 * t), 4 * std::sin(0.8 * t + 1), 2 + std::sin(1.3 * t)};
  }
  virtual Eigen::Vector3d Velocity(double t) const {
    return {3 * std::cos(0.5 * t), 3.2 * std::cos(0.8 * t + 1), 1.3 * std::cos(1.3 * t)};
  }
  virtual Eigen::Vector3d Acceleration(double t) const {
    return {-1.5 * std::sin(0.5 * t), -2.56 * std::sin(0.8 * t + 1), -1.69 * std::sin(1.3 * t)};
  }
  virtual Eigen::Vector3d Turn(double t) const {
    return {0.2 * std::sin(t), 0.3 * std::sin(0.7 * t), 0.9 * std::sin(0.4 * t)};
  }

  Eigen::Quaterniond Rotation(double t) const { return RotationExp(Turn(t)); }
  SE3 WorldFromImu(double t) const { return {Rotation(t), Position(t)}; }
  Eigen::Vector3d AngularVelocity(double t) const {
    constexpr double kStep = 1e-4;
    return RotationLog(Rotation(t - kStep).conjugate() * Rotation(t + kStep)) / (2 * kStep);
  }
  Eigen::Vector3d SpecificForce(double t) const {
    return Rotation(t).conjugate() * (Acceleration(t) + kGravity_m_s2 * Eigen::Vector3d::UnitZ());
  }

  std::vector<ImuSample> Samples(double from_s, double to_s, double rate_hz) const {
    std::vector<ImuSample> samples;
    for (int i = 0; from_s + i / rate_hz <= to_s; ++i) {
      const double t = from_s + i / rate_hz;
      samples.push_back({AtSeconds(t), AngularVelocity(t), SpecificForce(t)});
    }
    return samples;
  }

  /// Of a camera in a world that is `world_from_level` of this one.
  Trajectory CameraPath(double from_s, double to_s, double rate_hz, const SE3& cam_from_imu,
                        const Sim3& world_from_level) const {
    Trajectory path;
    for (int i = 0; from_s + i / rate_hz <= to_s; ++i) {
      const double t = from_s + i / rate_hz;
      path.push_back({AtSeconds(t), WorldFromImu(t) * cam_from_imu.Inverse()});
    }
    return MoveTrajectory(world_from_level, path);
  }
};

inline Eigen::Vector3d GaussianVector(double sigma, Random* random) {
  Eigen::Vector3d noise;
  for (double& value : noise) value = random->Gaussian(sigma);
  return noise;
}

}  // namespace deepuav
