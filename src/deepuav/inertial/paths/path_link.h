#pragma once

#include <optional>
#include <string>

#include "deepuav/geometry/sim3.h"
#include "deepuav/geometry/timed_pose.h"
#include "deepuav/inertial/inertial_options.h"
#include "deepuav/inertial/paths/dead_reckoning.h"

namespace deepuav {

/// Where a path lies in the world of motions that are known before or after it.
struct LinkAttempt {
  std::optional<Sim3> world_from_path;
  std::string reason;  ///< Why not, for a person.
};

/// Of a path in metres with z up, whose own motion is `there`, at a moment near that of `known`:
/// the heading and the place are what the samples between both tell.
LinkAttempt LinkMotions(const MotionState& known, const MotionState& there,
                        const DeadReckoning& reckoning, const InertialOptions& options);

/// Of a path of no known scale or level: the similarity under which its camera's poses nearest to
/// `known` in time lie where the samples lead. Refused where the camera hardly moves there.
LinkAttempt LinkPath(const MotionState& known, const Trajectory& path, const SE3& cam_from_imu,
                     const DeadReckoning& reckoning, const InertialOptions& options);

}  // namespace deepuav
