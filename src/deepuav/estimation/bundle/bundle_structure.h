#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "deepuav/estimation/bundle/bundle_adjustment.h"

namespace deepuav {

/// An observation that takes part in the adjustment.
struct GroupedObservation {
  int camera = 0;
  int free_camera = 0;  ///< Index among the free cameras; -1 for a fixed one.
  int group = 0;
  Eigen::Vector2d px;
  Whitening whitening;
  Eigen::Vector3d drift_cam_per_s;
};

/// What is known of the focal length beforehand: its logarithm is normally distributed.
struct FocalPrior {
  double guess_px = 1;
  double per_sigma = 0;  ///< 1 / standard deviation of the logarithm; 0: nothing is known.

  double Error(double fx) const { return per_sigma * std::log(fx / guess_px); }
};

/// What is known of the principal point beforehand.
struct CentrePrior {
  Eigen::Vector2d guess_px = Eigen::Vector2d::Zero();
  double per_sigma_px = 0;  ///< 0: nothing is known.

  /// In standard deviations.
  Eigen::Vector2d Error(const Pinhole& pinhole) const {
    return per_sigma_px * (Eigen::Vector2d(pinhole.cx, pinhole.cy) - guess_px);
  }
};

/// What is known beforehand of parameters that are near 0, or near a guess: distortion and readout.
struct SmallPrior {
  double per_k1_sigma = 0, per_k2_sigma = 0;  ///< 0: nothing is known.
  double per_tangential_sigma = 0, per_readout_sigma_s = 0;
  Eigen::Vector2d radial_guess = Eigen::Vector2d::Zero();  ///< k1 and k2.
};

/// Which cameras and landmarks move, and the observations grouped by landmark. A landmark moves if
/// at least two usable observations (finite, sigma above 0) see it; other landmarks and their
/// observations take no part. A camera moves if it is not fixed and sees a landmark that moves.
struct BundleStructure {
  explicit BundleStructure(const BundleProblem& problem);

  int groups() const { return static_cast<int>(landmark_of_group.size()); }
  int free_cameras() const { return static_cast<int>(camera_of_free.size()); }
  /// In how many parts sums over its groups are made, one after the other in each: it alone decides
  /// the rounding, whatever the number of threads.
  int parts() const;

  std::vector<int> camera_of_free;
  std::vector<int> landmark_of_group;
  /// By group, within a group by free camera (fixed ones first), else in the order of the problem.
  std::vector<GroupedObservation> observations;
  std::vector<int> group_begin;  ///< One per group and the end.
  /// The observations of each free camera, ascending: those of free camera i are
  /// camera_observations[camera_begin[i] .. camera_begin[i + 1]).
  std::vector<int> camera_observations, camera_begin;
  FocalPrior focal_prior;
  CentrePrior centre_prior;
  SmallPrior small_prior;
  std::vector<int> free_of_camera;  ///< By camera; -1 for one that does not move.
  CameraFactors factors;
  std::vector<CameraPairBlock> camera_pairs;  ///< Free cameras that share a factor, zero blocks.
};

/// Throws Error for sizes that do not fit, indices out of range, or poses and a calibration that
/// are not finite.
void CheckBundleProblem(const BundleProblem& problem);

/// Finite and with a sigma above 0.
bool UsableObservation(const BundleObservation& observation);

}  // namespace deepuav
