#include "deepuav/inertial/paths/dead_reckoning.h"

#include "deepuav/inertial/chain/inertial_adjustment.h"

namespace deepuav {

std::optional<MotionState> DeadReckoning::At(Timestamp time, const MotionState& from) const {
  if (time == from.time) return from;
  const bool onwards = from.time < time;
  const Timestamp first = OnSensorClock(onwards ? from.time : time, clock_offset_s_);
  const Timestamp last = OnSensorClock(onwards ? time : from.time, clock_offset_s_);
  const std::optional<Preintegration> motion = imu_.Between(first, last, from.bias);
  if (!motion) return std::nullopt;
  const double seconds = motion->duration_s;
  const Eigen::Vector3d gravity(0, 0, -gravity_m_s2_);
  MotionState there = from;
  there.time = time;
  const Eigen::Quaterniond& here = from.world_from_imu.rotation();
  const Eigen::Quaterniond first_rotation =
      onwards ? here : (here * motion->rotation.conjugate()).normalized();
  const Eigen::Vector3d gained = seconds * gravity + first_rotation * motion->velocity_m_s;
  const Eigen::Vector3d first_velocity =
      onwards ? from.velocity_m_s : Eigen::Vector3d(from.velocity_m_s - gained);
  const Eigen::Vector3d moved = seconds * first_velocity + 0.5 * seconds * seconds * gravity +
                                first_rotation * motion->position_m;
  const Eigen::Vector3d& position = from.world_from_imu.translation();
  if (onwards) {
    there.world_from_imu = {(here * motion->rotation).normalized(), position + moved};
    there.velocity_m_s = from.velocity_m_s + gained;
  } else {
    there.world_from_imu = {first_rotation, position - moved};
    there.velocity_m_s = first_velocity;
  }
  return there;
}

}  // namespace deepuav
