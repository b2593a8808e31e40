#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "deepuav/geometry/timed_pose.h"
#include "deepuav/inertial/chain/inertial_state.h"
#include "deepuav/inertial/inertial_options.h"

namespace deepuav {

/// What camera and inertial sensor say of one path.
struct InertialProblem {
  const ImuIntegrator* imu;  ///< Must outlive it.
  SE3 cam_from_imu;
  Trajectory path;  ///< Of the camera, in the map's world: one pose a state.
  /// Standard deviations of these poses' errors, rad and map units, one a state.
  std::vector<double> turn_sigma_rad, position_sigma;
  /// Whether the motion from a state to the next one was measured: one a state, but the last. It is
  /// decided once, as a link that comes and goes as the clock moves would make the cost jump.
  std::vector<uint8_t> linked;
  InertialOptions options;

  /// Sets `linked`: samples lie there wherever the clock may be.
  void LinkStates();
  size_t size() const { return path.size(); }
  Eigen::Vector3d camera_in_imu_m() const { return cam_from_imu.InverseTranslation(); }
  Eigen::Quaterniond WorldFromImu(const TimedPose& pose) const {
    return pose.world_from_cam.rotation() * cam_from_imu.rotation();
  }
};

/// A time of the images as the sensor's clock shows it. `clock_offset_s` is added to the sensor's.
Timestamp OnSensorClock(Timestamp time, double clock_offset_s);

/// How far the path's poses lie from the states', not whitened: turn (rad) and position (map
/// units).
std::vector<Vector6d> PathResiduals(const InertialProblem& problem,
                                    const std::vector<InertialState>& states);

/// What noise leaves open of the states as a whole.
struct InertialCovariance {
  double log_scale_sigma = 0;
  double down_sigma_rad = 0;  ///< About the less certain axis.
  double clock_sigma_s = 0;
};

/// How well the adjusted states fit.
struct InertialFit {
  double cost = 0;
  double imu_chi_square = 0;  ///< Of the integrated motions, a degree of freedom.
  bool converged = false;
};

/// Adjusts the states to path and samples: a pose graph with velocities, biases that walk, and
/// scale, gravity and clock offset that walk slowly, solved by Levenberg-Marquardt on the chain of
/// states. Robust against single wrong poses.
InertialFit AdjustInertial(const InertialProblem& problem, int iterations,
                           std::vector<InertialState>* states);

/// `scale_weights`: of the mean of the logarithms of scale whose covariance is asked for; one a
/// state, of sum 1. Nothing where the states are not determined.
std::optional<InertialCovariance> CovarianceOf(const InertialProblem& problem,
                                               const std::vector<InertialState>& states,
                                               const std::vector<double>& scale_weights);

}  // namespace deepuav
