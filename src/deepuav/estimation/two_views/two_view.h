#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// The pixels of one point in two views, undistorted.
struct PixelPair {
  Eigen::Vector2d a_px, b_px;
  double noise_ratio = 1;  ///< Standard deviation of both over that of detected pixels.
};

struct TwoViewOptions {
  double max_error_px = 1.5;  ///< Inlier bound: distance to epipolar line or transferred pixel.
  double confidence = 0.9999;
  int max_iterations = 2000;
  int min_inliers = 50;
  double min_parallax_deg = 1.0;  ///< Median over the points.
  double max_distance_sigma =
      0.05;             ///< Standard deviation of a certain point's distance over the distance.
  int min_certain = 0;  ///< Such points, fewer than which are no solution.
  double min_valid_ratio = 0;  ///< Valid points over pairs, fewer than which are no solution.
  /// Where less than this share of the pairs is valid, the rest may be what stands, and the valid
  /// what moves before a camera that holds still...
  double min_undisputed_ratio = 0;
  double min_moved_ratio = 0;  ///< ...unless this share of the valid points shows parallax.
  double min_sigma_px =
      0.3;  ///< Of detected pixels, where the residuals, from which it follows, are smaller.
  double min_front_ratio =
      0.9;  ///< Of the inliers, in front of both cameras, for a solution to be kept.
  double min_homography_share =
      0.1;  ///< Of the two models' scores, from which the homography's poses are tried too.
  double min_support_ratio = 0.75;  ///< Valid points of a second solution over the first's.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_error_px", max_error_px, "px",
          "distance of an inlier to its epipolar line or transferred pixel", Above(0, 1000));
    visit("confidence", confidence, "", "confidence of the RANSAC", Within(0, 1));
    visit("max_iterations", max_iterations, "", "most samples of the RANSAC", Between(1, 20'000));
    visit("min_inliers", min_inliers, "", "fewest points of a two-view solution",
          Between(8, 100'000));
    visit("min_parallax_deg", min_parallax_deg, "deg",
          "least median parallax of a two-view solution", Between(0, 90));
    visit("max_distance_sigma", max_distance_sigma, "",
          "standard deviation of a certain point's distance over the distance, at most",
          Above(0, 100));
    visit("min_certain", min_certain, "", "certain points of a two-view solution, at least",
          Between(0, 100'000));
    visit("min_valid_ratio", min_valid_ratio, "", "valid points over pairs, at least",
          Between(0, 1));
    visit("min_undisputed_ratio", min_undisputed_ratio, "",
          "valid points over pairs, below which things that move are reckoned with", Between(0, 1));
    visit("min_moved_ratio", min_moved_ratio, "",
          "share of the valid points that must show parallax then", Between(0, 1));
    visit("min_sigma_px", min_sigma_px, "px",
          "standard deviation of pixels, where the residuals are smaller", Above(0, 100));
    visit("min_front_ratio", min_front_ratio, "",
          "share of the inliers that must lie in front of both cameras", Above(0.5, 1));
    visit("min_homography_share", min_homography_share, "",
          "share of both models' scores from which the homography's poses are tried too",
          Below(0, 1));
    visit("min_support_ratio", min_support_ratio, "",
          "valid points of a second solution over the first's", Above(0, 1));
  }
};

/// One reconstruction of two views: unit baseline, points in camera a.
struct TwoViewSolution {
  SE3 b_from_a;
  std::vector<Eigen::Vector3d> points_a;  ///< One per pair; meaningful where `valid`.
  std::vector<uint8_t> valid;  ///< Inlier, in front of both, reprojected within the bound.
  int valid_count = 0;
  std::vector<uint8_t> certain;  ///< Valid, and its distance is known: see TwoViewOptions.
  int certain_count = 0;
  double sigma_px = 0;  ///< Of detected pixels, as EpipolarSigmaPx.
  double support = 0;   ///< Of the valid points, each by how far within the bound it reprojects.
  double median_parallax_deg = 0;
};

struct TwoViewResult {
  /// By falling support. Mostly one from a general scene; two from a plane, and where little
  /// parallax makes a scene look like one: only a third view can tell them apart.
  std::vector<TwoViewSolution> solutions;
};

/// Relative pose of two calibrated views: homography and essential matrix estimated side by side
/// and scored on the same truncated error (Mur-Artal 2015, section IV). Unlike there both are
/// decomposed unless the scene is deep: of a plane either may miss the true one of the two poses
/// that explain it, and of a shallow scene the noise may lead the essential matrix to a false one.
/// Nothing for too few inliers, too little parallax or pure rotation: `agreeing`,
/// if asked for, tells them apart, by the inliers of the model that has more.
std::optional<TwoViewResult> EstimateTwoView(const Pinhole& pinhole,
                                             const std::vector<PixelPair>& pairs, uint64_t seed,
                                             const TwoViewOptions& options,
                                             int* agreeing = nullptr);

}  // namespace deepuav
