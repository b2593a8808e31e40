#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/pixel_noise.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// A landmark and the pixel where a frame sees it.
struct PoseObservation {
  Eigen::Vector3d landmark_world;
  Eigen::Vector2d px;
  PixelNoise noise = {};
};

struct MotionOnlyOptions {
  int rounds = 4;       ///< Outliers are classified anew after each.
  int iterations = 10;  ///< Gauss-Newton steps a round.
  double chi_square =
      5.991;  ///< 95 % of a 2-D error; inlier bound and Huber threshold (its square root).

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("rounds", rounds, "",
          "rounds of optimisation, each followed by a new classification of outliers",
          Between(1, 50));
    visit("iterations", iterations, "", "Gauss-Newton steps a round", Between(1, 100));
    visit("chi_square", chi_square, "",
          "bound on the squared error in standard deviations of an inlier", Above(0, 1e6));
  }
};

struct MotionOnlyResult {
  SE3 cam_from_world;
  std::vector<uint8_t> inlier;  ///< One per observation.
  int inlier_count = 0;
  double rms_px = 0;                        ///< Of the inliers.
  Matrix6d information = Matrix6d::Zero();  ///< J^T W J at the solution, twist [translation;
                                            ///< rotation], left-multiplied.
};

/// Optimises a camera pose against fixed landmarks (ORB-SLAM, Mur-Artal 2015, section V; Huber loss
/// in all rounds but the last). The landmarks behind the camera are outliers. With fewer than 3
/// inliers the pose returned is `initial`.
MotionOnlyResult OptimisePose(const Pinhole& pinhole,
                              const std::vector<PoseObservation>& observations,
                              const SE3& initial_cam_from_world, const MotionOnlyOptions& options);

}  // namespace deepuav
