#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/geometry/sim3.h"
#include "deepuav/geometry/timed_pose.h"
#include "deepuav/inertial/inertial_options.h"
#include "deepuav/inertial/paths/dead_reckoning.h"

namespace deepuav {

/// What an inertial sensor tells of a path.
struct InertialAlignment {
  /// Metres, z up. The path's first camera is at the origin and looks along x; where it looks
  /// nearly straight up or down, its image's upper edge lies there.
  Sim3 level_from_world;
  double scale_sigma = 0;  ///< As a share of the scale.
  double tilt_sigma_rad = 0;
  SE3 cam_from_imu;            ///< As stated, or its rotation as turns tell it.
  double mount_sigma_rad = 0;  ///< Of that rotation; 0: stated.
  double clock_offset_s = 0;   ///< To be added to the sensor's times.
  double clock_sigma_s = 0;
  ImuBias bias;                    ///< Mean over the path.
  double turn_residual_rad = 0;    ///< Of the path's poses, root mean square an axis.
  double position_residual_m = 0;  ///< The same.
  double chi_square = 0;           ///< Of the integrated motions, a degree of freedom.
  double scale_spread = 0;  ///< By which the scale wanders along the path, root mean square, as a
                            ///< share.
  double duration_s = 0;    ///< Of the path with samples.
  std::vector<MotionState> motions;  ///< At poses of the path, by time, in the level world.
};

/// The level world of an alignment: z along `up_world`, metres of which the world's unit has
/// `scale`, the first camera at the origin and looking along x, as above.
Sim3 LevelByFirstCamera(const SE3& first_world_from_cam, const Eigen::Vector3d& up_world,
                        double scale);

struct InertialAttempt {
  std::optional<InertialAlignment> found;
  std::string reason;  ///< Why nothing was found, for a person.
};

/// Finds scale, gravity, biases, velocities and clock offset under which the samples fit the path.
/// Refused, with the reason, where samples are too few, do not fit, or leave the scale open, as in
/// a flight at constant speed. The same input gives the same result. `stop`, if given, is asked
/// between the rounds.
InertialAttempt AlignInertially(const Trajectory& path, const ImuStream& imu,
                                const InertialOptions& options,
                                const std::function<bool()>& stop = nullptr);

}  // namespace deepuav
