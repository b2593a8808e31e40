#include "deepuav/looping/turns_to_try.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/option_check.h"

namespace deepuav {

void TurnsToTryOptions::Check() const { CheckOptions("looping.turns", *this); }

QuarterTurns TurnsToTry(const SE3& camera, const SE3& place, const TurnsToTryOptions& options) {
  constexpr double kDegrees = 180 / M_PI;
  QuarterTurns turns = {};
  const Eigen::Quaterniond place_from_camera = place.rotation() * camera.rotation().conjugate();
  const double cosine = (place_from_camera * Eigen::Vector3d::UnitZ()).z();
  if (std::acos(std::clamp(cosine, -1.0, 1.0)) * kDegrees > options.max_angle_deg) return turns;
  // The part about the optical axis, which turns an image clockwise where it is positive.
  const double turned_deg = 2 * std::atan2(place_from_camera.z(), place_from_camera.w()) * kDegrees;
  for (size_t i = 0; i < turns.size(); ++i) {
    const double left_deg = std::remainder(turned_deg - 90.0 * static_cast<double>(i + 1), 360.0);
    turns[i] = std::abs(left_deg) <= options.max_turn_deg;
  }
  return turns;
}

}  // namespace deepuav
