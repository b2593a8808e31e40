#pragma once

#include <Eigen/Core>
#include <optional>

#include "deepuav/geometry/rolling_shutter.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// A small piece of a surface as a view sees it: the undistorted pixel of its middle, that point,
/// and the surface's normal, both in the view's camera frame.
struct SurfacePatch {
  Eigen::Vector2d px;  ///< As its middle row sees it.
  Eigen::Vector3d point_cam;
  Eigen::Vector3d normal_cam;  ///< Of any length; not at right angles to the ray.
  ReadoutMotion motion = {};   ///< Of the view.
};

/// d image pixel / d undistorted pixel of the lens at an undistorted pixel; nothing where the model
/// has no inverse there. The identity without distortion.
std::optional<Eigen::Matrix2d> DistortionJacobian(const Camera& camera, const Eigen::Vector2d& px);

/// d image pixel of b / d image pixel of a at the patch seen in view a, under the plane through its
/// point. Nothing where b does not see it from the front, or at a grazing angle.
std::optional<Eigen::Matrix2d> PatchWarp(const SurfacePatch& patch_a, const SE3& b_from_a,
                                         const Camera& camera);

}  // namespace deepuav
