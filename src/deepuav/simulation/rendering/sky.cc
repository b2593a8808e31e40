#include "deepuav/simulation/rendering/sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "deepuav/simulation/world/filtered_patterns.h"

namespace deepuav {
namespace {

constexpr float kGroundAlbedo = 0.2f;
// Of the sky's mean radiance, for light of strength 1 on level ground.
constexpr float kHorizonGain = 1.9f, kZenithGain = 0.75f;
// Koschmieder: contrast falls to 5 % at -ln(0.05) extinction lengths.
constexpr double kVisibilityLengths = 2.9957;

}  // namespace

Sky::Sky(const WeatherOptions& weather, const MaterialTextures& textures)
    : textures_(textures),
      sun_(static_cast<float>(weather.sun)),
      sky_(static_cast<float>(weather.sky)),
      clouds_(static_cast<float>(weather.clouds)),
      extinction_per_m_(static_cast<float>(kVisibilityLengths / weather.visibility_m)) {
  const double elevation = weather.sun_elevation_deg * std::numbers::pi / 180;
  const double azimuth = weather.sun_azimuth_deg * std::numbers::pi / 180;
  sun_direction_ = Eigen::Vector3d(std::sin(azimuth) * std::cos(elevation),
                                   std::cos(azimuth) * std::cos(elevation), std::sin(elevation))
                       .cast<float>();
  bounce_ = kGroundAlbedo * (sun_ * std::max(0.0f, sun_direction_.z()) + sky_);
}

float Sky::Clear(const Eigen::Vector3f& direction) const {
  const float up = std::max(direction.z(), 0.0f);
  const float gradient = Mix(kHorizonGain, kZenithGain, std::sqrt(up));
  const float towards_sun = std::max(0.0f, direction.dot(sun_direction_));
  const float square = towards_sun * towards_sun, fourth = square * square;
  const float glow = fourth * fourth * fourth;  // The twelfth power.
  return sky_ * gradient + 0.35f * sun_ * glow;
}

float Sky::Radiance(const Eigen::Vector3f& direction) const {
  const float clear = Clear(direction);
  if (direction.z() < 0.01f || clouds_ <= 0) return clear;
  const float scale = 0.25f / (direction.z() + 0.08f);
  const float noise = textures_[Material::kPlaster].Sample(direction.x() * scale,
                                                           direction.y() * scale, 0.004f * scale);
  const float threshold = 1 - clouds_;
  const float cover = SmoothStep(threshold - 0.12f, threshold + 0.2f, noise);
  const float shade = 1 - 0.45f * SmoothStep(threshold + 0.1f, threshold + 0.5f, noise);
  const float cloud = (1.7f * sky_ + 0.55f * sun_) * shade;
  return Mix(clear, cloud, cover * SmoothStep(0.01f, 0.12f, direction.z()));
}

float Sky::Hazed(float radiance, float distance_m, const Eigen::Vector3f& direction) const {
  const float passed = std::exp(-extinction_per_m_ * distance_m);
  if (passed > 0.999f) return radiance;
  const Eigen::Vector3f level(direction.x(), direction.y(), 0.05f);
  return passed * radiance + (1 - passed) * Clear(level.normalized());
}

}  // namespace deepuav
