#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/time.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/inertial/chain/preintegration.h"

namespace deepuav {

/// The order of the parameters of a state's step.
enum InertialParameter {
  kRotation = 0,
  kPosition = 3,
  kVelocity = 6,
  kGyroscopeBias = 9,
  kAccelerometerBias = 12,
  kLogScaleOfMap = 15,
  kDown = 16,
  kClock = 18,
  kStateSize = 19,
};
using StateStep = Eigen::Matrix<double, kStateSize, 1>;

/// Camera and inertial sensor at the moment of one image. All axes are those of the map's world.
/// Scale, gravity and clock offset are there at each moment, because the path of a camera bends:
/// they may wander slowly.
struct InertialState {
  Eigen::Quaterniond world_from_imu = Eigen::Quaterniond::Identity();
  Eigen::Vector3d camera = Eigen::Vector3d::Zero();        ///< Position, map units.
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();  ///< Of the sensor.
  ImuBias bias;
  double log_scale = 0;  ///< Of metres per map unit.
  Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  double clock_offset_s = 0;  ///< To be added to the sensor's times.
};

/// How the sensor moves at the moment of a state.
struct InertialMotion {
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();   ///< rad/s, its own axes.
  Eigen::Vector3d camera_per_s = Eigen::Vector3d::Zero();       ///< Map units a second.
  Eigen::Vector3d acceleration_m_s2 = Eigen::Vector3d::Zero();  ///< The world's axes.
};

/// Two axes across a direction, the same ones for the same direction.
Eigen::Matrix<double, 3, 2> AxesAcross(const Eigen::Vector3d& direction);

/// `camera_in_imu_m`: the camera's position in the sensor's axes.
InertialMotion MotionOf(const InertialState& state, const ImuSample& sample,
                        const Eigen::Vector3d& camera_in_imu_m, double gravity_m_s2);

/// The state after a step. A change of the clock moves it along its motion.
InertialState Moved(const InertialState& state, const StateStep& step,
                    const InertialMotion& motion);

}  // namespace deepuav
