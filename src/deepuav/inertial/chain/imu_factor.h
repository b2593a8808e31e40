#pragma once

#include "deepuav/inertial/chain/inertial_state.h"

namespace deepuav {

/// By how far two states miss what was integrated between them.
struct ImuResidual {
  Vector9d value;  ///< Turn, velocity, position: as the rows of Preintegration.
  Eigen::Matrix<double, 9, kStateSize> by_first, by_last;
};

/// `motion`: integrated with the first state's biases.
ImuResidual ResidualOf(const InertialState& first, const InertialState& last,
                       const Preintegration& motion, const Eigen::Vector3d& camera_in_imu_m,
                       double gravity_m_s2);

}  // namespace deepuav
