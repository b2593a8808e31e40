#pragma once

#include <Eigen/Core>
#include <optional>

#include "deepuav/geometry/se3.h"

namespace deepuav {

/// The point, in the world, seen along ray_a (depth-1 vector in camera a) and ray_b: linear least
/// squares (DLT, Hartley and Zisserman 12.2). Nothing where the rays are parallel to within
/// numerical noise. The result may lie behind a camera: check the depths.
std::optional<Eigen::Vector3d> TriangulatePoint(const SE3& a_from_world,
                                                const Eigen::Vector3d& ray_a,
                                                const SE3& b_from_world,
                                                const Eigen::Vector3d& ray_b);

/// The angle at `point` between the directions to the two camera centres, radians.
double ParallaxAngle(const Eigen::Vector3d& centre_a, const Eigen::Vector3d& centre_b,
                     const Eigen::Vector3d& point);

}  // namespace deepuav
