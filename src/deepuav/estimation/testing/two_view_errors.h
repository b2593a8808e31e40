#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/estimation/two_views/two_view.h"

namespace deepuav {

inline constexpr double kDegree = M_PI / 180;

inline double RotationErrorDeg(const SE3& estimate, const SE3& truth) {
  return (estimate * truth.Inverse()).Angle() / kDegree;
}
inline double DirectionErrorDeg(const SE3& estimate, const SE3& truth) {
  return std::acos(
             std::clamp(estimate.translation().normalized().dot(truth.translation().normalized()),
                        -1.0, 1.0)) /
         kDegree;
}

inline double ErrorDeg(const TwoViewSolution& solution, const SE3& truth) {
  return std::max(RotationErrorDeg(solution.b_from_a, truth),
                  DirectionErrorDeg(solution.b_from_a, truth));
}

/// The solution nearest to the truth in rotation and direction of travel.
inline double BestErrorDeg(const TwoViewResult& result, const SE3& truth) {
  double best = std::numeric_limits<double>::infinity();
  for (const TwoViewSolution& s : result.solutions) best = std::min(best, ErrorDeg(s, truth));
  return best;
}

/// Bound of an inlier for points with 1 px of noise in both images.
inline TwoViewOptions NoisyOptions() {
  TwoViewOptions options;
  options.max_error_px = 3;
  return options;
}

}  // namespace deepuav
