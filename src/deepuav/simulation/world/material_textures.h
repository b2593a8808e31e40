#pragma once

#include <cstdint>
#include <vector>

#include "deepuav/simulation/world/mip_texture.h"

namespace deepuav {

/// The repeated textures of which all surfaces are mixed. Each has a mean of about 0.5.
enum class Material {
  kNoise,  ///< Equal contrast at all scales, as landscapes have.
  kGrass,  ///< Blades and tufts.
  kLeaves,
  kSoil,  ///< Clods and small stones.
  kGravel,
  kAsphalt,   ///< Grain, cracks and mended patches.
  kConcrete,  ///< Slabs with stains.
  kPlaster,
  kBricks,     ///< 16 courses a tile.
  kRoofTiles,  ///< 16 courses a tile.
  kPlanks,
  kPaving,
  kRipples,  ///< Of water.
  kPrint,    ///< Posters, labels, shop fronts: shapes and lettering; 4 x 4 of them.
};
inline constexpr int kMaterialCount = 14;

class MaterialTextures {
 public:
  explicit MaterialTextures(uint32_t seed);

  const MipTexture& operator[](Material material) const {
    return textures_[static_cast<size_t>(material)];
  }

 private:
  std::vector<MipTexture> textures_;
};

}  // namespace deepuav
