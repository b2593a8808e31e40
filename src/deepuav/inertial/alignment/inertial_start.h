#pragma once

#include <optional>
#include <vector>

#include "deepuav/inertial/chain/inertial_adjustment.h"

namespace deepuav {

/// Where an adjustment may start from.
struct InertialStart {
  double clock_offset_s = 0;
  Eigen::Vector3d gyroscope_bias_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias_m_s2 = Eigen::Vector3d::Zero();
  double scale = 0;  ///< Metres per map unit; may come out negative where nothing tells it.
  Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  double turn_misfit_rad = 0;  ///< Between camera and gyroscope, root mean square a step.
};

/// Gyroscope bias and clock offset from the camera's turns, then scale, gravity and accelerometer
/// bias from pairs of steps, in which velocities cancel (Mur-Artal 2017, "Visual-inertial monocular
/// SLAM with map reuse", section IV, here with the bias held by a prior). Nothing where fewer than
/// a few steps have samples.
std::optional<InertialStart> FindInertialStart(const InertialProblem& problem);

/// The states of that start along the path.
std::vector<InertialState> StatesOf(const InertialProblem& problem, const InertialStart& start);

}  // namespace deepuav
