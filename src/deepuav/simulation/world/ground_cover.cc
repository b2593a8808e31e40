#include "deepuav/simulation/world/ground_cover.h"

#include <algorithm>
#include <cmath>

#include "deepuav/image/image.h"
#include "deepuav/simulation/world/filtered_patterns.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

// Albedos of what the ground is made of.
constexpr float kGrassTone = 0.2f, kSoilTone = 0.23f, kStrawTone = 0.42f, kAsphaltTone = 0.15f;
constexpr float kPaintTone = 0.62f, kPavementTone = 0.33f, kSandTone = 0.45f, kMudTone = 0.17f;

// Single things on the ground, as stones, weeds and molehills: ovals with clear edges, at most one
// a cell. A factor about 1.
float SpotFactor(float u, float v, float cell_m, uint32_t seed, float footprint) {
  if (footprint > 0.6f * cell_m) return 1;
  const float cu = u / cell_m, cv = v / cell_m;
  const float i = std::floor(cu), j = std::floor(cv);
  const uint32_t hash = HashCell(static_cast<int32_t>(i), static_cast<int32_t>(j), seed);
  constexpr uint32_t kPresent = 0xb8;  // Of 256.
  if ((hash & 0xff) > kPresent) return 1;
  const auto unit = [hash](int shift) { return static_cast<float>((hash >> shift) & 0xff) / 255; };
  const float radius = 0.05f + 0.17f * unit(8) * unit(16);
  const float du = cu - i - (0.3f + 0.4f * unit(16)), dv = cv - j - (0.3f + 0.4f * unit(24));
  const float lean = 1.2f * (unit(24) - 0.5f);
  const float across = du + lean * dv, along = (1.2f - unit(8)) * 0.5f * du + dv;
  const float squared = across * across + along * along;
  const float edge = std::max(0.12f * radius, footprint / cell_m) / 2;
  if (squared >= (radius + edge) * (radius + edge)) return 1;
  const float distance = std::sqrt(squared);
  const float cover = 1 - SmoothStep(radius - edge, radius + edge, distance);
  return 1 + cover * (unit(8) < 0.5f ? -0.45f : 0.55f);
}

float HashOf(float cell, uint32_t seed) {
  return UnitFromHash(HashCell(static_cast<int32_t>(cell), 0, seed));
}

}  // namespace

GroundCover::GroundCover(const SceneOptions& options, const MaterialTextures& textures,
                         const ParcelMap& parcels, const RoadNetwork& roads)
    : textures_(textures),
      parcels_(parcels),
      roads_(roads),
      aridity_(static_cast<float>(options.aridity)) {
  if (options.orthophoto.empty()) return;
  const GreyImage photo = LoadGrey(options.orthophoto);
  photo_ = std::make_unique<MipTexture>(photo, MipTexture::Edge::kClamp);
  photo_width_m_ = static_cast<float>(photo.cols * options.orthophoto_cell_m);
}

float GroundCover::Albedo(float x, float y, float height_m, float footprint_m) const {
  if (photo_) return PhotoAlbedo(x, y, footprint_m);
  Spot spot{x, y, footprint_m, 0, 0};
  spot.middle = 1.3f * Detail(Material::kNoise, 0.96f * x + 0.28f * y, 0.96f * y - 0.28f * x, 31,
                              footprint_m);
  spot.large = 1.4f * Detail(Material::kNoise, x, y, 330, footprint_m);

  const RoadNetwork::Place road = roads_.Find(x, y);
  if (road.road != nullptr && road.edge_m < 0) return RoadAlbedo(spot, road);
  const ParcelMap::Place place = parcels_.Find(x, y);
  const bool street = road.road != nullptr && road.road->road_class == RoadClass::kStreet;
  constexpr float kPavementM = 1.7f;
  if (street && place.parcel->in_town && road.edge_m < kPavementM)
    return PavementAlbedo(spot, road);
  float albedo = FieldAlbedo(spot, *place.parcel, place.border_m);
  // Worn edges beside the road, and mud at the water.
  const float verge = 1 - SmoothStep(0, 1.1f + 0.8f * spot.middle, road.edge_m);
  albedo = Mix(albedo, kSoilTone * (1.1f + 0.4f * spot.middle), 0.7f * verge);
  const float shore = 1 - SmoothStep(0.25f, 0.8f + 0.3f * spot.middle, height_m);
  if (shore <= 0) return albedo;
  return Mix(albedo, kMudTone * (1 + 0.5f * Detail(Material::kGravel, x, y, 4, footprint_m)),
             shore);
}

float GroundCover::PhotoAlbedo(float x, float y, float footprint_m) const {
  const float u = x / photo_width_m_ + 0.5f;
  const float v = photo_->aspect() / 2 - y / photo_width_m_;
  const float level = photo_->Sample(u, v, footprint_m / photo_width_m_);
  // Photographs are written with a gamma of about 2.
  constexpr float kBrightest = 0.6f;
  const float fine = Detail(Material::kNoise, x, y, 6, footprint_m);
  return kBrightest * level * level * (1 + 0.25f * fine) + 0.01f;
}

float GroundCover::FieldAlbedo(const Spot& spot, const Parcel& parcel, float border_m) const {
  const auto ax = static_cast<float>(parcel.along.x()), ay = static_cast<float>(parcel.along.y());
  const float dx = spot.x - static_cast<float>(parcel.centre.x());
  const float dy = spot.y - static_cast<float>(parcel.centre.y());
  const float u = ax * dx + ay * dy, v = ax * dy - ay * dx;
  float albedo = 0;
  switch (parcel.kind) {
    case ParcelKind::kMeadow:
      albedo = GrassAlbedo(spot, u, v);
      break;
    case ParcelKind::kCrop:
      albedo = CropAlbedo(spot, parcel, u, v);
      break;
    case ParcelKind::kWheat:
      albedo = WheatAlbedo(spot, parcel, u, v);
      break;
    case ParcelKind::kPloughed:
      albedo = PloughedAlbedo(spot, parcel, u, v);
      break;
    case ParcelKind::kStubble:
      albedo = StubbleAlbedo(spot, parcel, u, v);
      break;
    case ParcelKind::kPlain:
      albedo = 0.27f * (1 + 0.03f * spot.middle + 0.04f * spot.large);
      break;
    case ParcelKind::kForest:
      albedo = 0.11f *
               (1 + 0.5f * Detail(Material::kLeaves, u, v, 5, spot.footprint) + 0.3f * spot.middle);
      break;
    case ParcelKind::kOrchard:
      albedo = Mix(GrassAlbedo(spot, u, v), kSoilTone,
                   0.7f * StripeCoverage(v + 0.3f * spot.middle + 0.9f, 6, 1.8f, spot.footprint));
      break;
    case ParcelKind::kGarden:
      albedo = GardenAlbedo(spot, parcel, u, v);
      break;
    case ParcelKind::kSquare:
      albedo = SquareAlbedo(spot, parcel, u, v);
      break;
    case ParcelKind::kSand:
    case ParcelKind::kScrub:
      albedo = DesertAlbedo(spot, parcel, u, v);
      break;
  }
  albedo *= parcel.tone * (1 + 0.3f * spot.large);
  if (parcel.kind != ParcelKind::kPlain) {
    const float wu = u + 0.2f * spot.middle, wv = v + 0.15f * spot.middle;
    for (const float cell_m : {0.45f, 1.7f, 6.1f, 19.0f}) {
      albedo *= SpotFactor(wu, wv, cell_m, parcel.seed, spot.footprint);
    }
  }
  if (parcel.in_town) {
    // A fence or kerb round the plot.
    const float fence = BandCoverage(-1, 0.09f, border_m, spot.footprint);
    return Mix(albedo, parcel.seed % 3 == 0 ? 0.5f : 0.1f, fence);
  }
  const float margin = 1 - SmoothStep(0.7f, 1.3f, border_m + 0.5f * spot.middle);
  if (margin <= 0) return albedo;
  return Mix(albedo, 0.85f * GrassAlbedo(spot, v, u), margin);
}

float GroundCover::GrassAlbedo(const Spot& spot, float u, float v) const {
  const float blades = Detail(Material::kGrass, u, v, 3.1f, spot.footprint);
  // Tufts and bare patches with clear outlines.
  const float blotch = Detail(Material::kNoise, u + 7, v, 13, spot.footprint);
  const float bare = SmoothStep(0.45f, 0.6f, blotch) * 0.5f;
  const float tuft = SmoothStep(0.5f, 0.62f, -blotch) * 0.35f;
  const float grass = kGrassTone * (1 + 0.7f * blades + 0.4f * spot.middle) * (1 - tuft);
  const float dry = Mix(grass, 1.3f * grass, aridity_);
  return Mix(dry, kSoilTone * (1.15f + 0.6f * blades), bare);
}

float GroundCover::CropAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const {
  const float period = parcel.seed % 2 == 0 ? 0.75f : 1.5f;
  const float leaves = Detail(Material::kLeaves, u, v, 2.7f, spot.footprint);
  const float soil = Detail(Material::kSoil, u, v, 3.3f, spot.footprint);
  // Plants of uneven size, with gaps where the noise is low.
  const float grown = std::clamp(0.55f + 0.35f * spot.middle, 0.05f, 0.95f);
  const float wander = 0.12f * spot.middle;
  const float plants = StripeCoverage(v + wander, period, period * grown, spot.footprint);
  return Mix(kSoilTone * (1.1f + 0.5f * soil), 0.15f * (1 + 0.6f * leaves), plants);
}

float GroundCover::WheatAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const {
  const float ears = Detail(Material::kGrass, v, u, 2.3f, spot.footprint);
  constexpr float kTramlinesM = 21, kGaugeM = 1.8f, kTyreM = 0.45f;
  const float wander = v + 0.25f * spot.middle;
  const float tracks = StripeCoverage(wander, kTramlinesM, kTyreM, spot.footprint) +
                       StripeCoverage(wander + kGaugeM, kTramlinesM, kTyreM, spot.footprint);
  const float tone = 0.22f + 0.12f * UnitFromHash(HashCell(1, 0, parcel.seed));
  // Places where wind laid the stalks down.
  const float laid = SmoothStep(0.35f, 0.5f, Detail(Material::kNoise, u, v, 43, spot.footprint));
  const float wheat = tone * (1 + 0.45f * ears + 0.22f * spot.middle) * (1 - 0.22f * laid);
  return Mix(wheat, kSoilTone * 0.8f, 0.8f * std::min(tracks, 1.0f));
}

float GroundCover::PloughedAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const {
  const float clods = Detail(Material::kSoil, u, v, 3.7f, spot.footprint);
  const float wander = v + 0.2f * spot.middle;
  const float furrow = StripeCoverage(wander, 0.5f, 0.25f, spot.footprint);
  constexpr float kPassM = 3.5f;
  const float pass = HashOf(std::floor(wander / kPassM), parcel.seed);
  const float pass_tone = (pass - 0.5f) * 0.3f * DetailVisibility(kPassM, spot.footprint);
  return 0.72f * kSoilTone *
         (1 + 0.5f * clods + 0.35f * spot.middle + 0.35f * (furrow - 0.5f) + pass_tone);
}

float GroundCover::StubbleAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const {
  const float straw = Detail(Material::kGrass, u, v, 2.9f, spot.footprint);
  const float wander = v + 0.4f * spot.middle;
  const float swath = StripeCoverage(wander, 6, 1.4f, spot.footprint);
  const float rows = StripeCoverage(wander, 0.3f, 0.12f, spot.footprint);
  constexpr float kPassM = 6;
  const float pass = HashOf(std::floor(wander / kPassM), parcel.seed) - 0.5f;
  const float pass_tone = 0.2f * pass * DetailVisibility(kPassM, spot.footprint);
  return kStrawTone * (0.8f + 0.3f * straw + 0.2f * spot.middle + pass_tone) *
         (1 + 0.3f * (swath - 0.25f) - 0.25f * (rows - 0.4f));
}

float GroundCover::GardenAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const {
  // Beds, terraces and gravel on a grid of cells that differ from plot to plot.
  const float cell_m = 2.2f + 1.6f * UnitFromHash(HashCell(3, 0, parcel.seed));
  const float lawn_stripe = StripeCoverage(v, 1.2f, 0.6f, spot.footprint) - 0.5f;
  const float lawn = GrassAlbedo(spot, u, v) * (1 + 0.12f * lawn_stripe);
  const float visibility = DetailVisibility(cell_m, spot.footprint);
  if (visibility <= 0) return lawn;
  const float cu = u + 0.5f * spot.middle, cv = v + 0.5f * spot.middle;
  const uint32_t hash = HashCell(static_cast<int32_t>(std::floor(cu / cell_m)),
                                 static_cast<int32_t>(std::floor(cv / cell_m)), parcel.seed);
  const float kind = UnitFromHash(hash);
  float cover = lawn;
  if (kind < 0.1f) {
    cover = kSoilTone * (0.7f + 0.6f * Detail(Material::kLeaves, u, v, 2, spot.footprint));
  } else if (kind < 0.22f) {
    cover = kPavementTone * (1 + 0.35f * Detail(Material::kPaving, u, v, 3.2f, spot.footprint));
  } else if (kind < 0.29f) {
    cover = 0.4f * (1 + 0.4f * Detail(Material::kGravel, u, v, 3, spot.footprint));
  }
  return Mix(lawn, cover, visibility);
}

float GroundCover::SquareAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const {
  if (parcel.seed % 2 == 0) {
    const float paving = Detail(Material::kPaving, u, v, 4.8f, spot.footprint);
    const float grid =
        StripeCoverage(u, 6, 0.5f, spot.footprint) + StripeCoverage(v, 6, 0.5f, spot.footprint);
    return kPavementTone * (1 + 0.35f * paving + 0.25f * spot.middle) *
           (1 - 0.35f * std::min(grid, 1.0f));
  }
  // A car park: bays of 2.5 m in rows of 5 m with lanes of 6 m between pairs.
  const float asphalt =
      kAsphaltTone * 1.1f *
      (1 + 0.35f * Detail(Material::kAsphalt, u, v, 4.3f, spot.footprint) + 0.3f * spot.middle);
  constexpr float kRowsM = 16, kBaysM = 10, kLineM = 0.12f;
  const float bays = StripeCoverage(u, 2.5f, kLineM, spot.footprint) *
                     StripeCoverage(v, kRowsM, kBaysM, spot.footprint);
  const float middle = StripeCoverage(v - kBaysM / 2, kRowsM, kLineM, spot.footprint);
  return Mix(asphalt, kPaintTone, 0.85f * std::min(1.0f, bays + middle));
}

float GroundCover::DesertAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const {
  const float gravel = Detail(Material::kGravel, u, v, 3.9f, spot.footprint);
  const float stones = SmoothStep(0.1f, 0.6f, Detail(Material::kNoise, u, v, 57, spot.footprint));
  const float wander = v + 3 * spot.middle;
  const float ripple = StripeCoverage(wander, 0.9f, 0.45f, spot.footprint) - 0.5f;
  // Dry stream beds: thin lines where large noise changes sign.
  const float wadi =
      1 - SmoothStep(0.02f, 0.06f,
                     std::abs(Detail(Material::kPlaster, spot.x, spot.y, 210, spot.footprint)));
  float albedo = kSandTone * (1 + 0.14f * spot.middle + 0.12f * (1 - stones) * ripple +
                              (0.12f + 0.35f * stones) * gravel);
  albedo *= 1 - 0.3f * wadi;
  if (parcel.kind == ParcelKind::kScrub) {
    const float dots =
        SmoothStep(0.35f, 0.5f, Detail(Material::kNoise, u, v + 5, 9, spot.footprint));
    albedo *= 1 - 0.5f * dots;
  }
  return albedo;
}

float GroundCover::RoadAlbedo(const Spot& spot, const RoadNetwork::Place& place) const {
  if (place.road->road_class == RoadClass::kTrack) return TrackAlbedo(spot, place);
  const float asphalt = Asphalt(spot, place);
  if (place.junction) return asphalt;
  const float worn = 0.75f + 0.5f * Detail(Material::kAsphalt, spot.y, spot.x, 3, spot.footprint);
  const float paint = Markings(place, spot.footprint) * std::clamp(worn, 0.0f, 1.0f);
  return Mix(asphalt, kPaintTone, paint);
}

float GroundCover::Asphalt(const Spot& spot, const RoadNetwork::Place& place) const {
  const float half_width = place.road->half_width_m, across = std::abs(place.across_m);
  const float fine =
      Detail(Material::kAsphalt, place.along_m, place.across_m, 4.7f, spot.footprint);
  float tone = kAsphaltTone * (1 + 0.55f * fine + 0.35f * spot.middle);
  // Tyres polish two bands a lane.
  const float lane_middle = std::abs(across - 0.48f * half_width);
  tone *= 1 + 0.12f * (1 - SmoothStep(0.3f, 0.7f, std::abs(lane_middle - 0.75f)));
  // Mended rectangles and manhole covers, one chance every few metres.
  const float cell = std::floor(place.along_m / 7);
  const auto seed = static_cast<uint32_t>(place.road->points.size()) * 31u;
  const float at = place.along_m - 7 * cell, lane = place.across_m / half_width;
  const float chance = HashOf(cell, seed);
  if (chance < 0.3f) {
    const float low = -1 + 1.4f * HashOf(cell, seed + 1), length = 1 + 5 * HashOf(cell, seed + 2);
    const float patch = BandCoverage(low, low + 0.6f, lane, spot.footprint / half_width) *
                        BandCoverage(0.5f, length, at, spot.footprint);
    tone *= 1 + (chance < 0.2f ? -0.4f : 0.35f) * patch;
  } else if (chance > 0.75f) {
    const float centre = half_width * (HashOf(cell, seed + 3) - 0.5f);
    const float side = place.across_m - centre, ahead = at - 3.5f;
    const float radius = std::sqrt(side * side + ahead * ahead);
    const float cover = BandCoverage(-1, 0.38f, radius, spot.footprint);
    const float rim = BandCoverage(0.3f, 0.38f, radius, spot.footprint);
    tone *= 1 - 0.45f * cover + 0.9f * rim;
  }
  return tone;
}

float GroundCover::Markings(const RoadNetwork::Place& place, float footprint) const {
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

float GroundCover::PavementAlbedo(const Spot& spot, const RoadNetwork::Place& place) const {
  const float paving =
      Detail(Material::kPaving, place.along_m, place.across_m, 3.2f, spot.footprint);
  const float kerb = BandCoverage(0, 0.14f, place.edge_m, spot.footprint);
  return Mix(kPavementTone * (1 + 0.35f * paving + 0.25f * spot.middle), 0.48f, kerb);
}

float GroundCover::TrackAlbedo(const Spot& spot, const RoadNetwork::Place& place) const {
  const float gravel =
      Detail(Material::kGravel, place.along_m, place.across_m, 3.4f, spot.footprint);
  const float wander = std::abs(place.across_m + 0.25f * spot.middle);
  const float rut = SmoothStep(0.25f, 0.4f, wander) * (1 - SmoothStep(0.95f, 1.15f, wander));
  const float stones = 0.36f * (1 + 0.4f * gravel + 0.25f * spot.middle);
  return Mix(GrassAlbedo(spot, place.along_m, place.across_m), stones, 0.25f + 0.75f * rut);
}

}  // namespace deepuav
