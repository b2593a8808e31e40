#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// The undistorted pixels of one point in three views.
struct PixelTriple {
  Eigen::Vector2d a_px, b_px, c_px;
  double noise_ratio = 1;  ///< Standard deviation of all three over that of detected pixels.
};

/// Three views and what they see, with camera a as the world.
struct ThreeViews {
  SE3 b_from_a, c_from_a;
  std::vector<Eigen::Vector3d> points_a;  ///< One a triple; of no use where not in front of all.
};

/// Adjusts poses and points together (Huber loss from `max_error_px` on). Points that do not lie in
/// front of all views, or are some times that far off to begin with, take no part.
void AdjustThreeViews(const Pinhole& pinhole, const std::vector<PixelTriple>& triples,
                      double max_error_px, ThreeViews* views);

/// Of each triple the largest squared error of the three over that of `max_error_px`, at most 1.
std::vector<double> TruncatedErrors(const Pinhole& pinhole, const std::vector<PixelTriple>& triples,
                                    const ThreeViews& views, double max_error_px);

/// The same, the bound times each triple's noise ratio.
std::vector<double> WeightedErrors(const Pinhole& pinhole, const std::vector<PixelTriple>& triples,
                                   const ThreeViews& views, double max_error_px);

}  // namespace deepuav
