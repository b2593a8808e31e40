#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/time.h"
#include "deepuav/geometry/sim3.h"

namespace deepuav {

struct TimedPose {
  Timestamp time;
  SE3 world_from_cam;
};

/// Poses by growing time.
using Trajectory = std::vector<TimedPose>;

/// The poses after their world moved by the similarity: positions scaled, orientations turned.
Trajectory MoveTrajectory(const Sim3& new_from_old, const Trajectory& trajectory);

std::vector<Eigen::Vector3d> Positions(const Trajectory& trajectory);

/// Between two poses at a time between theirs: the position linearly, the orientation along the
/// shortest turn.
TimedPose InterpolatePose(const TimedPose& before, const TimedPose& after, Timestamp time);

}  // namespace deepuav
