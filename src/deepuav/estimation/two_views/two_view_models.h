#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/estimation/two_views/two_view.h"

namespace deepuav {

/// The model of two views that a robust estimate found, between pixels: b ~ homography * a, or b^T
/// * fundamental * a = 0.
struct TwoViewModel {
  Eigen::Matrix3d matrix;
  double score =
      0;  ///< Sum over pairs and images of the truncated error (Mur-Artal 2015, equation 2).
  std::vector<uint8_t> inlier;  ///< One per pair: within the truncation in both images.
  std::vector<SE3> b_from_a;    ///< The poses it decomposes into, unit baseline; four as a rule.
};

/// By USAC; nothing where it finds no model. Pairs that are not finite are left out.
std::optional<TwoViewModel> EstimateHomography(const Pinhole& pinhole,
                                               const std::vector<PixelPair>& pairs, uint64_t seed,
                                               const TwoViewOptions& options);
std::optional<TwoViewModel> EstimateEssential(const Pinhole& pinhole,
                                              const std::vector<PixelPair>& pairs, uint64_t seed,
                                              const TwoViewOptions& options);

bool Finite(const PixelPair& pair);

}  // namespace deepuav
