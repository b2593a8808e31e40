#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "deepuav/estimation/camera_factors.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// One pixel measurement of a landmark; indices into the problem's arrays.
struct BundleObservation {
  int camera = 0;
  int landmark = 0;
  Eigen::Vector2d px;
  double sigma_px = 1;
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

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_iterations", max_iterations, "", "most Levenberg-Marquardt steps");
    visit("chi_square", chi_square, "",
          "squared error over sigma from which the loss grows linearly");
    visit("min_relative_decrease", min_relative_decrease, "",
          "decrease of the cost below which a step is the last");
    visit("focal_sigma", focal_sigma, "",
          "standard deviation of a guessed focal length, as a share of it, where it is refined");
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

}  // namespace deepuav
