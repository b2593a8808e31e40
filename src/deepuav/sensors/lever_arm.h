#pragma once

#include <Eigen/Core>
#include <optional>

#include "deepuav/geometry/alignment.h"
#include "deepuav/geometry/timed_pose.h"

namespace deepuav {

/// The transform truth_from_estimate that minimises the sum of the squared distances of
/// scale * R * p_i + t + R * R_i * antenna from the positions of `truth`, where (R_i, p_i) is pose
/// i of the estimate and `antenna_cam_m` a point fixed to the camera, in metres of the truth, whose
/// path the truth is. Found from the alignment without lever arm by Gauss-Newton. Nothing where
/// Align finds nothing. Sizes must be equal.
std::optional<Sim3> AlignWithLeverArm(const Trajectory& truth, const Trajectory& estimate,
                                      AlignmentKind kind, const Eigen::Vector3d& antenna_cam_m);

/// The poses after their world moved by the similarity, taken to the point `antenna_cam_m` of the
/// camera: orientations stay the camera's.
Trajectory MoveToAntenna(const Sim3& new_from_old, const Trajectory& trajectory,
                         const Eigen::Vector3d& antenna_cam_m);

}  // namespace deepuav
