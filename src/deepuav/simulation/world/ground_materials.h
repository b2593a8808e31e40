#pragma once

#include <cstdint>

#include "deepuav/simulation/world/material_textures.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {

/// Albedos of what the ground is made of.
inline constexpr float kGrassTone = 0.2f, kSoilTone = 0.23f, kStrawTone = 0.42f,
                       kAsphaltTone = 0.15f;
inline constexpr float kPaintTone = 0.62f, kPavementTone = 0.33f, kSandTone = 0.45f,
                       kMudTone = 0.17f;

/// A place with what all covers need of it.
struct GroundSpot {
  float x, y;
  float footprint;      ///< Over which albedos are smoothed; metres.
  float middle, large;  ///< Noise of about a metre to 30 m and up to 300 m, -1 to 1.
};

/// A number from 0 to 1 for every cell of a line.
inline float UnitHash(float cell, uint32_t seed) {
  return UnitFromHash(HashCell(static_cast<int32_t>(cell), 0, seed));
}

/// What covers of all kinds are made of. Thread-safe.
class GroundMaterials {
 public:
  /// `textures` must outlive it. `aridity`: from 0 to 1, as of SceneOptions.
  GroundMaterials(const MaterialTextures& textures, float aridity)
      : textures_(textures), aridity_(aridity) {}

  /// The structure of a material whose tiles are `tile_m` long, smoothed, -1 to 1.
  float Detail(Material material, float u, float v, float tile_m, float footprint) const {
    return 2 * textures_[material].Sample(u / tile_m, v / tile_m, footprint / tile_m) - 1;
  }

  /// `u` and `v`: the spot in metres, along and across what the grass grows on.
  float GrassAlbedo(const GroundSpot& spot, float u, float v) const;

 private:
  const MaterialTextures& textures_;
  const float aridity_;
};

}  // namespace deepuav
