#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "deepuav/geometry/timed_pose.h"
#include "deepuav/inertial/chain/preintegration.h"
#include "deepuav/inertial/inertial_options.h"

namespace deepuav {

/// How an inertial sensor sits in a camera's axes, as the turns of both tell.
struct FoundMount {
  Eigen::Quaterniond cam_from_imu = Eigen::Quaterniond::Identity();
  double sigma_rad = 0;     ///< About the least certain axis.
  bool along_axes = false;  ///< Taken to be along the camera's axes, of which the turns tell which.
  double clock_offset_s = 0;  ///< To be added to the sensor's times.
};

/// The rotation under which the gyroscope's turns, less a bias, are those of the camera (Kabsch
/// 1976, reweighted about the median of the errors), at the clock offset that fits best. Turns
/// about one axis leave open what lies across it: then the mount along the camera's axes that is
/// nearest is taken, where only one is near. Nothing where the turns do not tell even that. `path`:
/// the camera's poses by growing time.
std::optional<FoundMount> FindMount(const Trajectory& path, const ImuIntegrator& imu,
                                    const InertialOptions& options);

}  // namespace deepuav
