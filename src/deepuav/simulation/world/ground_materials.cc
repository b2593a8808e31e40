#include "deepuav/simulation/world/ground_materials.h"

#include "deepuav/simulation/world/filtered_patterns.h"

namespace deepuav {

float GroundMaterials::GrassAlbedo(const GroundSpot& spot, float u, float v) const {
  const float blades = Detail(Material::kGrass, u, v, 3.1f, spot.footprint);
  // Tufts and bare patches with clear outlines.
  const float blotch = Detail(Material::kNoise, u + 7, v, 13, spot.footprint);
  const float bare = SmoothStep(0.45f, 0.6f, blotch) * 0.5f;
  const float tuft = SmoothStep(0.5f, 0.62f, -blotch) * 0.35f;
  const float grass = kGrassTone * (1 + 0.7f * blades + 0.4f * spot.middle) * (1 - tuft);
  const float dry = Mix(grass, 1.3f * grass, aridity_);
  return Mix(dry, kSoilTone * (1.15f + 0.6f * blades), bare);
}

}  // namespace deepuav
