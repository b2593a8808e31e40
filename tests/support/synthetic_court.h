#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "support/synthetic_flight.h"
#include "support/synthetic_places.h"

namespace deepuav {

inline constexpr int kLap = 240;  // frames

/// A round court whose walls are full of landmarks.
inline FeatureWorld Court(uint64_t seed) {
  Random random(seed);
  SyntheticWorld geometry;
  for (int i = 0; i < 2200; ++i) {
    const double angle = random.Uniform(0, 2 * std::numbers::pi);
    const double radius = random.Uniform(9, 13);
    geometry.landmarks_world.push_back(
        {radius * std::cos(angle), radius * std::sin(angle), random.Uniform(-5, 5)});
  }
  return FeatureWorld(geometry, seed + 1);
}

/// Seen from the inside, facing the wall, after `laps` of walking along it.
inline SE3 InCourt(double laps) {
  const double angle = 2 * std::numbers::pi * laps;
  const Eigen::Vector3d outward(std::cos(angle), std::sin(angle), 0);
  return LookAt((4 + 0.3 * std::sin(3 * angle)) * outward, 10 * outward, Eigen::Vector3d::UnitZ());
}

inline std::vector<SE3> Walk(double from_laps, int frames) {
  std::vector<SE3> path;
  for (int i = 0; i < frames; ++i) path.push_back(InCourt(from_laps + double(i) / kLap));
  return path;
}

inline void Append(const SyntheticFlight& more, SyntheticFlight* flight) {
  flight->cam_from_world.insert(flight->cam_from_world.end(), more.cam_from_world.begin(),
                                more.cam_from_world.end());
  flight->features.insert(flight->features.end(), more.features.begin(), more.features.end());
}

/// Of what a fifth of the frames show.
inline Vocabulary VocabularyOf(const SyntheticFlight& flight) {
  std::vector<Descriptors> images;
  for (size_t i = 0; i < flight.features.size(); i += 5)
    images.push_back(flight.features[i].descriptors);
  return VocabularyOf(images);
}

}  // namespace deepuav
