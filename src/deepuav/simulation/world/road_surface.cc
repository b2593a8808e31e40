#include "deepuav/simulation/world/road_surface.h"

#include <algorithm>
#include <cmath>

#include "deepuav/simulation/world/filtered_patterns.h"

namespace deepuav {

float RoadSurface::Albedo(const GroundSpot& spot, const RoadNetwork::Place& place) const {
  if (place.road->road_class == RoadClass::kTrack) return TrackAlbedo(spot, place);
  const float asphalt = Asphalt(spot, place);
  if (place.junction) return asphalt;
  const float worn =
      0.75f + 0.5f * materials_.Detail(Material::kAsphalt, spot.y, spot.x, 3, spot.footprint);
  const float paint = Markings(place, spot.footprint) * std::clamp(worn, 0.0f, 1.0f);
  return Mix(asphalt, kPaintTone, paint);
}

float RoadSurface::Asphalt(const GroundSpot& spot, const RoadNetwork::Place& place) const {
  const float half_width = place.road->half_width_m, across = std::abs(place.across_m);
  const float fine =
      materials_.Detail(Material::kAsphalt, place.along_m, place.across_m, 4.7f, spot.footprint);
  float tone = kAsphaltTone * (1 + 0.55f * fine + 0.35f * spot.middle);
  // Tyres polish two bands a lane.
  const float lane_middle = std::abs(across - 0.48f * half_width);
  tone *= 1 + 0.12f * (1 - SmoothStep(0.3f, 0.7f, std::abs(lane_middle - 0.75f)));
  // Mended rectangles and manhole covers, one chance every few metres.
  const float cell = std::floor(place.along_m / 7);
  const auto seed = static_cast<uint32_t>(place.road->points.size()) * 31u;
  const float at = place.along_m - 7 * cell, lane = place.across_m / half_width;
  const float chance = UnitHash(cell, seed);
  if (chance < 0.3f) {
    const float low = -1 + 1.4f * UnitHash(cell, seed + 1),
                length = 1 + 5 * UnitHash(cell, seed + 2);
    const float patch = BandCoverage(low, low + 0.6f, lane, spot.footprint / half_width) *
                        BandCoverage(0.5f, length, at, spot.footprint);
    tone *= 1 + (chance < 0.2f ? -0.4f : 0.35f) * patch;
  } else if (chance > 0.75f) {
    const float centre = half_width * (UnitHash(cell, seed + 3) - 0.5f);
    const float side = place.across_m - centre, ahead = at - 3.5f;
    const float radius = std::sqrt(side * side + ahead * ahead);
    const float cover = BandCoverage(-1, 0.38f, radius, spot.footprint);
    const float rim = BandCoverage(0.3f, 0.38f, radius, spot.footprint);
    tone *= 1 - 0.45f * cover + 0.9f * rim;
  }
  return tone;
}

float RoadSurface::Markings(const RoadNetwork::Place& place, float footprint) const {
  const float across = std::abs(place.across_m), half_width = place.road->half_width_m;
  const bool highway = place.road->road_class == RoadClass::kHighway;
  const float dash =
      StripeCoverage(place.along_m, highway ? 12.0f : 6.0f, highway ? 6.0f : 3.0f, footprint);
  float paint = BandCoverage(-0.08f, 0.08f, place.across_m, footprint) * dash;
  if (highway) {
    paint += BandCoverage(half_width - 0.45f, half_width - 0.27f, across, footprint);
    return std::min(paint, 1.0f);
  }
  // A zebra crossing now and then.
  constexpr float kCrossingsM = 90, kCrossingM = 3;
  const float crossing = StripeCoverage(place.along_m - 30, kCrossingsM, kCrossingM, footprint);
  const float bars = StripeCoverage(place.across_m, 1, 0.5f, footprint);
  return Mix(std::min(paint, 1.0f), bars, crossing);
}

float RoadSurface::PavementAlbedo(const GroundSpot& spot, const RoadNetwork::Place& place) const {
  const float paving =
      materials_.Detail(Material::kPaving, place.along_m, place.across_m, 3.2f, spot.footprint);
  const float kerb = BandCoverage(0, 0.14f, place.edge_m, spot.footprint);
  return Mix(kPavementTone * (1 + 0.35f * paving + 0.25f * spot.middle), 0.48f, kerb);
}

float RoadSurface::TrackAlbedo(const GroundSpot& spot, const RoadNetwork::Place& place) const {
  const float gravel =
      materials_.Detail(Material::kGravel, place.along_m, place.across_m, 3.4f, spot.footprint);
  const float wander = std::abs(place.across_m + 0.25f * spot.middle);
  const float rut = SmoothStep(0.25f, 0.4f, wander) * (1 - SmoothStep(0.95f, 1.15f, wander));
  const float stones = 0.36f * (1 + 0.4f * gravel + 0.25f * spot.middle);
  return Mix(materials_.GrassAlbedo(spot, place.along_m, place.across_m), stones,
             0.25f + 0.75f * rut);
}

}  // namespace deepuav
