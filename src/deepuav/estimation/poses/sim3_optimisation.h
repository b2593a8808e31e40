#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/sim3.h"

namespace deepuav {

/// One landmark as two maps (or two ends of a loop) know it: its place in the frame of camera a in
/// the first map and of camera b in the second, each with the pixel where that camera sees it.
struct Sim3Correspondence {
  Eigen::Vector3d point_a, point_b;       ///< In the camera frames a and b, each in its map's unit.
  Eigen::Vector2d px_a, px_b;             ///< Where camera a sees point_a, and b point_b.
  double sigma_a_px = 1, sigma_b_px = 1;  ///< Of the key points.
};

/// Squared reprojection errors in sigmas of point_b in camera a and of point_a in camera b;
/// infinite behind a camera.
struct Sim3ChiSquares {
  double in_a, in_b;
  double larger() const { return in_a > in_b ? in_a : in_b; }
};
Sim3ChiSquares ReprojectBothWays(const Pinhole& pinhole, const Sim3Correspondence& correspondence,
                                 const Sim3& a_from_b, const Sim3& b_from_a);

/// Finite, in front of both cameras, with sigmas above 0.
bool UsableCorrespondence(const Sim3Correspondence& correspondence);

struct Sim3OptimisationOptions {
  int rounds = 4;             ///< Outliers are classified anew after each.
  int iterations = 10;        ///< Gauss-Newton steps a round.
  double chi_square = 9.210;  ///< 99 % of a 2-D error; inlier bound in both images and Huber
                              ///< threshold (its square root).
  bool fixed_scale = false;   ///< Keeps the initial scale.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("rounds", rounds, "",
          "rounds of optimisation, each followed by a new classification of outliers",
          Between(1, 50));
    visit("iterations", iterations, "", "Gauss-Newton steps a round", Between(1, 100));
    visit("chi_square", chi_square, "",
          "bound on the squared errors over sigma of an inlier in both images", Above(0, 1e6));
    visit("fixed_scale", fixed_scale, "", "keep the initial scale");
  }
};

struct Sim3OptimisationResult {
  Sim3 a_from_b;
  std::vector<uint8_t> inlier;  ///< One per correspondence: within the bound in both images.
  int inlier_count = 0;
  double rms_px = 0;  ///< Of the inliers' errors in both images.
  /// J^T W J at the solution, tangent as of Sim3::Exp, left-multiplied. The row and column of the
  /// scale are 0 where it is fixed.
  Matrix7d information = Matrix7d::Zero();
};

/// Optimises the similarity between two cameras' landmarks by the reprojection errors in both
/// images (Mur-Artal 2015, appendix; Huber loss in all rounds but the last). The landmarks behind a
/// camera are outliers. With fewer than 3 inliers the estimate returned is `initial`.
Sim3OptimisationResult OptimiseSim3(const Pinhole& pinhole,
                                    const std::vector<Sim3Correspondence>& correspondences,
                                    const Sim3& initial_a_from_b,
                                    const Sim3OptimisationOptions& options);

}  // namespace deepuav
