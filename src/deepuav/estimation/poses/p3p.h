#pragma once

#include <Eigen/Core>
#include <array>

#include "deepuav/geometry/se3.h"

namespace deepuav {

/// The poses that three points leave open.
struct P3PSolutions {
  std::array<SE3, 4> cams_from_world;
  int count = 0;
};

/// The up to four camera poses from which three points of the world are seen, in front of the
/// camera, along three rays (unit length, in the camera's coordinates). The points' distances are
/// where two conics meet; the degenerate member of their pencil gives two lines, which a conic cuts
/// in four points (Persson and Nordberg, ECCV 2018, for the equations; Ding et al., CVPR 2023, for
/// the lines). None of collinear points.
P3PSolutions SolveP3P(const std::array<Eigen::Vector3d, 3>& points_world,
                      const std::array<Eigen::Vector3d, 3>& rays_cam);

}  // namespace deepuav
