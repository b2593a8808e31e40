#pragma once

#include <optional>

#include "deepuav/estimation/bundle/bundle_camera.h"
#include "deepuav/geometry/camera.h"

namespace deepuav {

/// By how much the rays that `camera` sees lie elsewhere in the images of another one: root mean
/// square over the image, px; of those that the other one sees.
double MeanShiftPx(const Camera& camera, const Camera& other);

/// A calibration that does not quite fit leaves its undistorted pixels distorted: they are an image
/// that another camera took (Cvisic et al. 2021 found this of the rectified images of KITTI). What
/// it takes to correct calibration and pixels.
class LensCorrection {
 public:
  /// `taken_by`: the camera whose image the undistorted pixels of `calibrated` are. Nothing where
  /// no camera of Brown's model sees the same rays but for `max_error_px`, root mean square over
  /// the image; so for all that are equidistant.
  static std::optional<LensCorrection> Of(const Camera& calibrated, const BundleCamera& taken_by,
                                          double max_error_px);
  /// Where all of the lens was found anew, in the images as they were taken. Nothing where no
  /// camera is like that.
  static std::optional<LensCorrection> To(const BundleCamera& lens, const Camera& calibrated);

  /// In place of the calibration.
  const Camera& camera() const { return camera_; }
  /// Where its undistorted camera sees what that of the calibration sees at `px`.
  Eigen::Vector2d Correct(const Eigen::Vector2d& px) const;
  /// By how much rays move in the image: root mean square over it, px.
  double MeanShiftPx() const { return mean_shift_px_; }

 private:
  Camera camera_;
  Camera residual_;  ///< Whose image the calibration's undistorted pixels are; unless there is...
  std::optional<Camera> calibrated_;  ///< ...what the images themselves were undistorted by.
  double mean_shift_px_ = 0;
};

}  // namespace deepuav
