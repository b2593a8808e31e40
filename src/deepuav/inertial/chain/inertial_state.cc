#include "deepuav/inertial/chain/inertial_state.h"

#include <Eigen/Geometry>
#include <cmath>

namespace deepuav {

Eigen::Matrix<double, 3, 2> AxesAcross(const Eigen::Vector3d& direction) {
  Eigen::Index least = 0;
  direction.cwiseAbs().minCoeff(&least);
  Eigen::Matrix<double, 3, 2> axes;
  axes.col(0) = direction.cross(Eigen::Vector3d::Unit(least)).normalized();
  axes.col(1) = direction.cross(axes.col(0));
  return axes;
}

InertialMotion MotionOf(const InertialState& state, const ImuSample& sample,
                        const Eigen::Vector3d& camera_in_imu_m, double gravity_m_s2) {
  InertialMotion motion;
  motion.angular_velocity = sample.angular_velocity - state.bias.gyroscope_rad_s;
  motion.acceleration_m_s2 =
      state.world_from_imu * (sample.specific_force - state.bias.accelerometer_m_s2) +
      gravity_m_s2 * state.down;
  motion.camera_per_s =
      std::exp(-state.log_scale) *
      (state.velocity_m_s + state.world_from_imu * motion.angular_velocity.cross(camera_in_imu_m));
  return motion;
}

InertialState Moved(const InertialState& state, const StateStep& step,
                    const InertialMotion& motion) {
  const double later_s = -step[kClock];
  InertialState moved = state;
  moved.world_from_imu = (state.world_from_imu * RotationExp(step.segment<3>(kRotation)) *
                          RotationExp(later_s * motion.angular_velocity))
                             .normalized();
  moved.camera += step.segment<3>(kPosition) + later_s * motion.camera_per_s;
  moved.velocity_m_s += step.segment<3>(kVelocity) + later_s * motion.acceleration_m_s2;
  moved.bias.gyroscope_rad_s += step.segment<3>(kGyroscopeBias);
  moved.bias.accelerometer_m_s2 += step.segment<3>(kAccelerometerBias);
  moved.log_scale += step[kLogScaleOfMap];
  moved.down = (state.down + AxesAcross(state.down) * step.segment<2>(kDown)).normalized();
  moved.clock_offset_s += step[kClock];
  return moved;
}

}  // namespace deepuav
