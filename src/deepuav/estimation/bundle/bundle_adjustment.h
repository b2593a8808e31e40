#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/bundle/camera_factors.h"
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
  /// How the landmark moves in the camera, map units a second of readout, by the row that shows it:
  /// the camera's velocity, negative, times the row's place from -1/2 (first) to 1/2 (last). Where
  /// the readout is refined, something else must hold the world's scale.
  Eigen::Vector3d drift_cam_per_s = Eigen::Vector3d::Zero();
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
  /// Distortion of the observed pixels, of Camera's radial-tangential model, refined where the
  /// options say so.
  double k1 = 0, k2 = 0;
  double p1 = 0, p2 = 0;
  double readout_s = 0;       ///< Of a rolling shutter, from the first row to the last.
  double focal_guess_px = 0;  ///< What fx was before anything refined it; 0: what it is.
  std::optional<Eigen::Vector2d> centre_guess_px;          ///< The same of (cx, cy).
  Eigen::Vector2d radial_guess = Eigen::Vector2d::Zero();  ///< The same of (k1, k2).
};

struct BundleOptions {
  int max_iterations = 15;
  double chi_square = 5.991;  ///< Huber threshold is its square root; also the bound of `outlier`.
  double min_relative_decrease = 1e-4;  ///< Of the cost in a step: less counts as converged.
  bool refine_focal = false;            ///< One scale for fx and fy.
  double focal_sigma = 0.1;    ///< Standard deviation of the guess of the focal length, over it.
  bool refine_radial = false;  ///< k1 and k2.
  double k1_sigma = 0.5;       ///< Standard deviation of the guess of k1, where refined...
  double k2_sigma = 0.5;       ///< ...and of k2.
  bool refine_centre = false;  ///< The principal point.
  double centre_sigma = 0.02;  ///< Standard deviation of its guess, as a share of fx.
  bool refine_tangential = false;  ///< p1 and p2.
  double tangential_sigma = 0.01;  ///< Standard deviation of p1 and p2 about 0.
  bool refine_readout = false;     ///< Of a rolling shutter.
  double readout_sigma_s = 0.05;   ///< Standard deviation of its readout about 0.
  double initial_damping = 1e-4;   ///< Less where the state is nearly right already.
  /// A step is the last only if, besides, cameras and calibration are to move by less than
  /// standard deviations of this square in all. Landmarks with wrong observations, which move on
  /// for long, then need not be waited for.
  double max_last_move = 1e8;
  int threads = 1;  ///< They change nothing in the result.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_iterations", max_iterations, "", "most Levenberg-Marquardt steps", Between(0, 1000));
    visit("chi_square", chi_square, "",
          "squared error in standard deviations from which the loss grows linearly", Above(0, 1e6));
    visit("min_relative_decrease", min_relative_decrease, "",
          "decrease of the cost below which a step is the last", Below(0, 1));
    visit("focal_sigma", focal_sigma, "",
          "standard deviation of a guessed focal length, as a share of it, where it is refined",
          Above(0, 10));
    visit("k1_sigma", k1_sigma, "",
          "standard deviation of a guessed radial distortion k1, where it is refined",
          Above(0, 100));
    visit("k2_sigma", k2_sigma, "", "likewise of k2", Above(0, 100));
    visit("centre_sigma", centre_sigma, "",
          "standard deviation of a guessed principal point, as a share of the focal length, where "
          "it is refined",
          Above(0, 1));
    visit("tangential_sigma", tangential_sigma, "",
          "standard deviation of the tangential distortion about none, where it is refined",
          Above(0, 1));
    visit("readout_sigma_s", readout_sigma_s, "s",
          "standard deviation of a rolling shutter's readout about none, where it is refined",
          Above(0, 10));
    visit("initial_damping", initial_damping, "",
          "damping of the first step, over the diagonal of the normal equations",
          Between(1e-12, 1e6));
    visit("max_last_move", max_last_move, "",
          "square of the standard deviations by which cameras and calibration still move in the "
          "last step",
          Above(0, 1e8));
    visit("threads", threads, "", "threads, which change nothing in the result", Between(1, 64));
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
/// problem (fixed order, whatever the number of threads). `stop`, if given, is asked between the
/// steps.
BundleReport AdjustBundle(BundleProblem* problem, const BundleOptions& options,
                          const std::function<bool()>& stop = nullptr);

/// Of each observation at the problem's state, in standard deviations; infinite behind a camera.
std::vector<double> SquaredErrors(const BundleProblem& problem);

/// Standard deviations of what the problem tells of the calibration, at its present state, with the
/// priors of the options and the noise that the inliers' residuals show.
struct CalibrationSigmas {
  double focal = 0;  ///< Over the focal length.
  double k1 = 0, k2 = 0;
  double centre = 0;      ///< Over the focal length; the larger of both.
  double tangential = 0;  ///< The larger of p1's and p2's.
  double readout_s = 0;
};

/// Nothing where the options refine none of it, or the views do not tell it.
std::optional<CalibrationSigmas> EstimateCalibrationSigmas(const BundleProblem& problem,
                                                           const BundleOptions& options);

/// The covariance of each camera's cam_from_world, as a twist [translation; rotation] from the
/// left: what the problem tells of it at its present state, its lens taken as known, with the noise
/// that the inliers' residuals show. Zero for fixed cameras. The gauge must be held by fixed
/// cameras and factors: what is left open has covariances of no use. Nothing where there are no
/// observations left to tell the noise, or the system has no solution.
std::optional<std::vector<Matrix6d>> EstimateCameraCovariances(const BundleProblem& problem,
                                                               const BundleOptions& options);

}  // namespace deepuav
