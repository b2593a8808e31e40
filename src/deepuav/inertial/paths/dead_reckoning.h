#pragma once

#include <optional>

#include "deepuav/geometry/se3.h"
#include "deepuav/inertial/chain/preintegration.h"

namespace deepuav {

/// An inertial sensor at a moment of the images' clock, in a world in metres with z up.
struct MotionState {
  Timestamp time;
  SE3 world_from_imu;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
  ImuBias bias;
};

/// Carries motions on by samples alone. Immutable. The samples must outlive it.
class DeadReckoning {
 public:
  /// `clock_offset_s`: to be added to the samples' times.
  DeadReckoning(const ImuIntegrator& imu, double clock_offset_s, double gravity_m_s2)
      : imu_(imu), clock_offset_s_(clock_offset_s), gravity_m_s2_(gravity_m_s2) {}

  /// The state at `time`, before or after that of `from`; nothing where samples are missing.
  std::optional<MotionState> At(Timestamp time, const MotionState& from) const;

 private:
  const ImuIntegrator& imu_;
  const double clock_offset_s_;
  const double gravity_m_s2_;
};

}  // namespace deepuav
