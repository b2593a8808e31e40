#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "deepuav/estimation/sim3_optimisation.h"

namespace deepuav {

struct Sim3RansacOptions {
  /// Inlier bound in both images. Wider than the optimisation's: three triangulated landmarks carry
  /// their errors in depth into the sample's estimate.
  double chi_square = 16;
  double confidence = 0.999;  ///< That a sample without outliers was drawn.
  int max_iterations = 500;
  int min_inliers = 15;
  int refinements = 4;            ///< Most refinements of each new best sample on its inliers.
  int refinement_iterations = 4;  ///< Gauss-Newton steps of each.
  bool fixed_scale = false;       ///< Scale 1: both maps are metric.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("chi_square", chi_square, "",
          "bound on the squared errors over sigma of an inlier in both images");
    visit("confidence", confidence, "", "confidence that a sample without outliers was drawn");
    visit("max_iterations", max_iterations, "", "most samples");
    visit("min_inliers", min_inliers, "", "fewest inliers of a similarity that counts");
    visit("refinements", refinements, "",
          "most refinements of each new best sample on its inliers");
    visit("refinement_iterations", refinement_iterations, "", "Gauss-Newton steps of each");
    visit("fixed_scale", fixed_scale, "", "scale 1: both maps are metric");
  }
};

struct Sim3Estimate {
  Sim3 a_from_b;
  std::vector<uint8_t> inlier;  ///< One per correspondence: within the bound in both images.
  int inlier_count = 0;
  int iterations = 0;  ///< Samples drawn.
};

/// The similarity between two cameras' landmarks with outliers: samples of three (Umeyama 1991),
/// the truncated reprojection errors in both images as score (Mur-Artal 2015, section VII-B; Torr
/// and Zisserman 2000), each new best one refined on its inliers (Chum et al. 2003, locally
/// optimised RANSAC). Nothing with fewer than min_inliers inliers. The same seed gives the same
/// result.
std::optional<Sim3Estimate> EstimateSim3(const Pinhole& pinhole,
                                         const std::vector<Sim3Correspondence>& correspondences,
                                         uint64_t seed, const Sim3RansacOptions& options);

}  // namespace deepuav
