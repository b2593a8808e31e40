#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/estimation/bundle_camera.h"
#include "deepuav/geometry/radial_polynomial.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/survey/tracks.h"

namespace deepuav {

/// Pixels of every key point of every view: as measured, with the distortion of the lens where it
/// is refined, else without.
using ViewPixels = std::vector<std::vector<Eigen::Vector2d>>;

/// The lens of all photographs while it is being found.
struct SurveyLens {
  BundleCamera camera;
  bool is_refined = false;    ///< Else it stays as it is.
  double focal_guess_px = 0;  ///< What the prior says...
  double focal_sigma = 0.1;   ///< ...and how far it is to be trusted.

  /// The point at depth 1 that the pixel shows; nothing where the model has no inverse.
  std::optional<Eigen::Vector3d> Ray(const Eigen::Vector2d& px) const;
  /// The pixel without distortion.
  std::optional<Eigen::Vector2d> Undistort(const Eigen::Vector2d& px) const;
  /// Whether the lens is one-to-one as far as `radius_px` from the centre.
  bool IsOneToOne(double radius_px) const;
};

/// What is known of the photographs' poses and of the ground, by view and by track.
struct SurveyState {
  SurveyLens lens;
  std::vector<std::optional<SE3>> cam_from_world;
  std::vector<std::optional<Eigen::Vector3d>> points;
  std::vector<std::vector<uint8_t>> agrees;  ///< By track, one a sight: it counts.

  SurveyState(const Tracks& tracks, size_t views, const SurveyLens& survey_lens);
  int ViewCount() const;
};

/// The squared reprojection error of a point; infinite behind the camera.
double SquaredErrorPx(const BundleCamera& camera, const SE3& cam_from_world,
                      const Eigen::Vector3d& point, const Eigen::Vector2d& px);

}  // namespace deepuav
