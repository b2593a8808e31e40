#pragma once

#include <Eigen/Core>

#include "deepuav/geometry/pixel_noise.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// How well a landmark's observations, from keyframes that are where they are, tell its place: the
/// covariance of position_world times the squared focal length (px^2 times the map's units^2), as a
/// map knows no focal length. Along rays without parallax it is large, and finite.
Eigen::Matrix3d PositionNoise(const Map& map, const Landmark& landmark);

/// What such a position adds to the noise of the pixel where a camera expects it: little where the
/// landmark was seen from before, much where it is seen under more parallax than ever. None of a
/// landmark behind the camera, which no pixel shows.
PixelNoise ExpectedPixelNoise(const Eigen::Matrix3d& position_noise,
                              const Eigen::Vector3d& landmark_world, const SE3& cam_from_world);

}  // namespace deepuav
