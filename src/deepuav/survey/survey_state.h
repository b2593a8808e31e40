#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/estimation/bundle/bundle_camera.h"
#include "deepuav/geometry/pixel_noise.h"
#include "deepuav/geometry/radial_polynomial.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/survey/tracks/tracks.h"

namespace deepuav {

/// Where a view shows something: with the distortion of the lens where that is refined, else
/// without.
struct SightPixel {
  Eigen::Vector2d px;
  PixelNoise noise = 1.0;
  bool by_patch = false;  ///< Found by aligning patches, or the middle of one; else as detected.

  PixelNoise NoiseWith(double model_sigma_px) const {
    return by_patch ? noise.Plus(model_sigma_px) : noise;
  }
};

/// Of every key point of every view.
using ViewPixels = std::vector<std::vector<SightPixel>>;

/// The lens of all photographs while it is being found.
struct SurveyLens {
  BundleCamera camera;
  bool is_refined = false;    ///< Else it stays as it is.
  double focal_guess_px = 0;  ///< What the prior says...
  double focal_sigma = 0.1;   ///< ...and how far it is to be trusted.
  /// The focal length stays as it is meanwhile: the photographs seen so far don't tell it.
  bool holds_focal = false;
  Eigen::Vector2d centre_guess_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d radial_guess = Eigen::Vector2d::Zero();  ///< k1 and k2.
  /// Its centre, tangential distortion and readout are refined, too, and k2 however narrow it is.
  bool is_refined_wholly = false;

  /// The point at depth 1 that the pixel shows; nothing where the model has no inverse.
  std::optional<Eigen::Vector3d> Ray(const Eigen::Vector2d& px) const;
  /// The pixel without distortion.
  std::optional<Eigen::Vector2d> Undistort(const Eigen::Vector2d& px) const;
  /// Whether a point is before the camera, and where the model is that of the lens: beyond, it
  /// folds back into the image.
  bool Reaches(const Eigen::Vector3d& point_cam) const;
  /// Whether the lens is one-to-one as far as `radius_px` from the centre.
  bool IsOneToOne(double radius_px) const;
};

/// What is known of the photographs' poses and of the ground, by view and by track.
struct SurveyState {
  SurveyLens lens;
  std::vector<std::optional<SE3>> cam_from_world;
  std::vector<std::optional<Eigen::Vector3d>> points;
  std::vector<std::vector<uint8_t>> agrees;  ///< By track, one a sight: it counts.
  double model_sigma_px = 0;                 ///< What patches err by on top of their own noise.
  /// By view, map units a second, of photographs whose rows are read one after the other; empty
  /// where nothing is known.
  std::vector<Eigen::Vector3d> velocity_world;
  double image_rows = 1;

  SurveyState(const Tracks& tracks, size_t views, const SurveyLens& survey_lens);
  int ViewCount() const;
  /// Asks no more views than it must.
  bool HasViews(int at_least) const;
  bool Has(int view) const { return cam_from_world[static_cast<size_t>(view)].has_value(); }
  /// How a point moves in the view's camera in a second of readout, up to the row that shows it.
  Eigen::Vector3d DriftPerS(int view, double row_px) const;
  /// The point in the camera of a view that has a pose, when the row is read.
  Eigen::Vector3d InCamera(const Eigen::Vector3d& point, int view, double row_px) const;
};

/// A map of photographs, the tracks that its state is of, and where each was measured.
struct BuiltSurvey {
  Tracks tracks;
  SurveyState state;
  ViewPixels px;
};

/// The squared reprojection error of a point; infinite behind the camera.
double SquaredErrorPx(const BundleCamera& camera, const Eigen::Vector3d& point_cam,
                      const Eigen::Vector2d& px);

}  // namespace deepuav
