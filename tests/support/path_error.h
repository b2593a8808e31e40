#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "deepuav/geometry/alignment.h"

namespace deepuav {

/// Root mean square distance of the estimated positions to the true ones after Sim(3) alignment;
/// infinite where they cannot be aligned.
inline double RmseAfterAlignment(const std::vector<Eigen::Vector3d>& estimate,
                                 const std::vector<Eigen::Vector3d>& truth) {
  const auto truth_from_estimate = Align(estimate, truth, AlignmentKind::kSimilar);
  if (!truth_from_estimate) return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    sum += (*truth_from_estimate * estimate[i] - truth[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

}  // namespace deepuav
