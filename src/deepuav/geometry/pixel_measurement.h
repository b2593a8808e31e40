#pragma once

#include <Eigen/Core>

#include "deepuav/geometry/pixel_noise.h"

namespace deepuav {

/// Where the undistorted image shows something, and how far that is to be trusted.
struct PixelMeasurement {
  Eigen::Vector2f px = Eigen::Vector2f::Zero();
  PixelNoise noise;
  bool by_patch = false;  ///< Found by aligning patches, or the middle of one; else as detected.

  /// With what else patches err by, as by calibration and shutter: a detector's noise is stated far
  /// too large to need it.
  PixelNoise NoiseWith(double model_sigma_px) const {
    return by_patch ? noise.Plus(model_sigma_px) : noise;
  }
};

}  // namespace deepuav
