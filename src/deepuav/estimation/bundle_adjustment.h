#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "deepuav/estimation/camera_factors.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/pixel_noise.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// One pixel measurement of a landmark; indices into the problem's arrays.
struct BundleObservation {
  int camera = 0;
  int landmark = 0;
  Eigen::Vector2d px;
  PixelNoise noise = {};
};

/// Cameras and landmarks to be adjusted together, as values.
struct BundleProblem {
  Pinhole pinhole;
  std::vector<SE3> cam_from_world;
  std::vector<uint8_t>
      camera_fixed;  ///< One per camera. Without two fixed ones the gauge is held by damping.
  std::vector<Eigen::Vector3d> landmarks_world;
  std::vector<BundleObservation> observations;
  CameraFactors factors;  ///< What other sensors say of the cameras.
  /// Radial distortion k1, k2 of the observed pixels about (cx, cy), refined with the focal length
  /// where the options say so: px = centre + f (1 + k1 r^2 + k2 r^4) (x/z, y/z).
  double k1 = 0, k2 = 0;
  double focal_guess_px = 0;  ///< What fx was before anything refined it; 0: what it is.
};

struct BundleOptions {
  int max_iterations = 15;
  double chi_square = 5.991;  ///< Huber threshold is its square root; also the bound of `outlier`.
  double min_relative_decrease = 1e-4;  ///< Of the cost in a step: less counts as converged.
  bool refine_focal = false;            ///< One scale for fx and fy.
  double focal_sigma = 0.1;    ///< Standard deviation of the guess of the focal length, over it.
  bool refine_radial = false;  ///< k1 and k2.
  double k1_sigma = 0.5;       ///< Standard deviation of k1 about 0, where refined...
  double k2_sigma = 0.5;       ///< ...and of k2.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_iterations", max_iterations, "", "most Levenberg-Marquardt steps");
    visit("chi_square", chi_square, "",
          "squared error in standard deviations from which the loss grows linearly");
    visit("min_relative_decrease", min_relative_decrease, "",
          "decrease of the cost below which a step is the last");
    visit("focal_sigma", focal_sigma, "",
          "standard deviation of a guessed focal length, as a share of it, where it is refined");
    visit("k1_sigma", k1_sigma, "",
          "standard deviation of the radial distortion k1 about none, where it is refined");
    visit("k2_sigma", k2_sigma, "", "likewise of k2");
  }
};

struct BundleReport {
  int iterations = 0;
  double initial_cost = 0, final_cost = 0;
  bool converged = false;
  std::vector<uint8_t>
      outlier;  ///< One per observation: error above chi_square or behind the camera at the end.
};

/// Levenberg-Marquardt over camera poses and landmarks, landmarks eliminated by the Schur
/// complement, Huber loss. A focal length that is refined is held by its guess where nothing else
/// tells it from the height, as in level flight over flat ground. Cost and steps depend only on the
/// problem (no threads, fixed order). `stop`, if given, is asked between the steps.
BundleReport AdjustBundle(BundleProblem* problem, const BundleOptions& options,
                          const std::function<bool()>& stop = nullptr);

/// Standard deviations of what the problem tells of the calibration, at its present state, with the
/// priors of the options and the noise that the inliers' residuals show.
struct CalibrationSigmas {
  double focal = 0;  ///< Over the focal length.
  double k1 = 0, k2 = 0;
};

/// Nothing where the options refine none of it, or the views do not tell it.
std::optional<CalibrationSigmas> EstimateCalibrationSigmas(const BundleProblem& problem,
                                                           const BundleOptions& options);

}  // namespace deepuav
