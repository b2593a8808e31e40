#pragma once

#include <Eigen/Core>

#include "deepuav/geometry/pixel_noise.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// What views that are where they are tell of a point's place, summed up.
class PositionInformation {
 public:
  explicit PositionInformation(const Eigen::Vector3d& point_world) : point_world_(point_world) {}

  /// Of a view that shows the point with that noise, px; nothing of one that has it behind.
  void Add(const SE3& cam_from_world, const PixelNoise& noise);
  /// The covariance of the point times the squared focal length (px^2 times the units of the
  /// world^2). Along rays without parallax it is large, and finite; zero where nothing was added.
  Eigen::Matrix3d Noise() const;

 private:
  Eigen::Vector3d point_world_;
  Eigen::Matrix3d information_ = Eigen::Matrix3d::Zero();
};

/// How well a landmark's observations, from keyframes that are where they are, tell its place:
/// PositionInformation::Noise() of position_world, as a map knows no focal length.
Eigen::Matrix3d PositionNoise(const Map& map, const Landmark& landmark);

/// What such a position adds to the noise of the pixel where a camera expects it: little where the
/// landmark was seen from before, much where it is seen under more parallax than ever. None of a
/// landmark behind the camera, which no pixel shows.
PixelNoise ExpectedPixelNoise(const Eigen::Matrix3d& position_noise,
                              const Eigen::Vector3d& landmark_world, const SE3& cam_from_world);

}  // namespace deepuav
