#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// The pixels of one point in two views, undistorted.
struct PixelPair {
  Eigen::Vector2d a_px, b_px;
};

struct TwoViewOptions {
  double max_error_px = 1.5;  ///< Inlier bound: distance to epipolar line or transferred pixel.
  double confidence = 0.9999;
  int max_iterations = 2000;
  int min_inliers = 50;
  double min_parallax_deg = 1.0;  ///< Median over the points.
  double min_front_ratio =
      0.9;  ///< Of the inliers, in front of both cameras, for a solution to be kept.
  double planar_ratio =
      0.40;  ///< Homography's share of the two scores above which the scene counts as a plane.
  double min_support_ratio =
      0.75;  ///< Support of a second planar solution relative to the first's.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_error_px", max_error_px, "px",
          "distance of an inlier to its epipolar line or transferred pixel");
    visit("confidence", confidence, "", "confidence of the RANSAC");
    visit("max_iterations", max_iterations, "", "most samples of the RANSAC");
    visit("min_inliers", min_inliers, "", "fewest points of a two-view solution");
    visit("min_parallax_deg", min_parallax_deg, "deg",
          "least median parallax of a two-view solution");
    visit("min_front_ratio", min_front_ratio, "",
          "share of the inliers that must lie in front of both cameras");
    visit("planar_ratio", planar_ratio, "",
          "homography's share of both scores above which the scene counts as a plane");
    visit("min_support_ratio", min_support_ratio, "",
          "support of a second planar solution relative to the first's");
  }
};

/// One reconstruction of two views: unit baseline, points in camera a.
struct TwoViewSolution {
  SE3 b_from_a;
  std::vector<Eigen::Vector3d> points_a;  ///< One per pair; meaningful where `valid`.
  std::vector<uint8_t> valid;  ///< Inlier, in front of both, reprojected within the bound.
  int valid_count = 0;
  double median_parallax_deg = 0;
};

struct TwoViewResult {
  bool planar =
      false;  ///< The homography explains the pairs about as well as the essential matrix does.
  double homography_score = 0, essential_score = 0;
  /// By falling support. One from a general scene; up to two from a plane, which only a third view
  /// can tell apart.
  std::vector<TwoViewSolution> solutions;
};

/// Relative pose of two calibrated views: homography and essential matrix estimated side by side
/// and scored on the same truncated error (Mur-Artal 2015, section IV). A general scene's essential
/// matrix is decomposed; of a plane, both are, since either may miss the true one of the two poses
/// that explain it. Nothing for too few inliers, too little parallax or pure rotation: `agreeing`,
/// if asked for, tells them apart, by the inliers of the model that has more.
std::optional<TwoViewResult> EstimateTwoView(const Pinhole& pinhole,
                                             const std::vector<PixelPair>& pairs, uint64_t seed,
                                             const TwoViewOptions& options,
                                             int* agreeing = nullptr);

}  // namespace deepuav
