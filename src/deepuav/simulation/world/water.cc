#include "deepuav/simulation/world/water.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "deepuav/base/random.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

using Eigen::Vector2f;

constexpr float kMeanderLength = 210;
constexpr float kShoreLength = 0.7f;  // Of the lake's radius.
constexpr float kFar = 1e6f;

}  // namespace

Water::Water(const SceneOptions& options)
    : half_extent_(static_cast<float>(options.extent_m / 2)),
      river_half_width_(static_cast<float>(options.river_width_m / 2)),
      lake_radius_(static_cast<float>(options.lake_radius_m)),
      seed_(HashCell(options.seed, 3, 0x3a7e5u)) {
  Random random(seed_);
  const double angle = random.Uniform(0, 2 * std::numbers::pi);
  river_along_ = Vector2f(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)));
  river_across_ = Vector2f(-river_along_.y(), river_along_.x());
  river_swing_ = 0.05f * half_extent_;
  // The river passes by the town, and the lake lies at the town's other side.
  const double room = options.extent_m / 2 - river_swing_ - options.river_width_m;
  river_shift_ = static_cast<float>(
      std::min(room, options.town_radius_m + 2 * river_swing_ + options.river_width_m));
  const double lake_room = options.extent_m / 2 - 1.2 * options.lake_radius_m;
  const double lake_distance =
      std::min(lake_room, options.town_radius_m + 1.5 * options.lake_radius_m + 20);
  const auto along = static_cast<float>(random.Uniform(-0.5, 0.5) * lake_distance);
  lake_centre_ = -static_cast<float>(lake_distance) * river_across_ + along * river_along_;
}

float Water::RiverOffset(float along) const {
  return river_shift_ +
         river_swing_ * (1.4f * GradientNoise(along / kMeanderLength, 0.37f, 0, seed_) +
                         0.4f * GradientNoise(along / 71, 0.71f, 0, seed_ + 1));
}

float Water::LakeShoreDistance(const Vector2f& point) const {
  if (lake_radius_ <= 0) return kFar;
  const Vector2f q = (point - lake_centre_) / (kShoreLength * lake_radius_);
  const float wobble = 0.3f * GradientNoise(q.x(), q.y(), 0, seed_ + 2) +
                       0.1f * GradientNoise(4 * q.x(), 4 * q.y(), 0, seed_ + 3);
  return (point - lake_centre_).norm() - lake_radius_ * (1 + wobble);
}

float Water::ShoreDistance(float x, float y) const {
  float distance = LakeShoreDistance({x, y});
  if (river_half_width_ > 0) {
    const Vector2f point(x, y);
    const float along = point.dot(river_along_);
    const float slope = (RiverOffset(along + 1) - RiverOffset(along - 1)) / 2;
    const float from_middle =
        std::abs(point.dot(river_across_) - RiverOffset(along)) / std::sqrt(1 + slope * slope);
    distance = std::min(distance, from_middle - river_half_width_);
  }
  return distance;
}

std::vector<Eigen::Vector2d> Water::RiverLine() const {
  std::vector<Eigen::Vector2d> line;
  if (river_half_width_ <= 0) return line;
  constexpr float kStepM = 5;
  for (float along = -1.5f * half_extent_; along < 1.5f * half_extent_; along += kStepM) {
    const Vector2f point = along * river_along_ + RiverOffset(along) * river_across_;
    if (point.cwiseAbs().maxCoeff() < half_extent_) line.push_back(point.cast<double>());
  }
  return line;
}

bool Water::InLake(const Eigen::Vector2d& point) const {
  constexpr float kMarginM = 6;
  return LakeShoreDistance(point.cast<float>()) < kMarginM;
}

}  // namespace deepuav
