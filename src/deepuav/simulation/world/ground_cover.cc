#include "deepuav/simulation/world/ground_cover.h"

#include <algorithm>
#include <cmath>

#include "deepuav/image/image.h"
#include "deepuav/simulation/world/filtered_patterns.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

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

}  // namespace

GroundCover::GroundCover(const SceneOptions& options, const MaterialTextures& textures,
                         const ParcelMap& parcels, const RoadNetwork& roads)
    : materials_(textures, static_cast<float>(options.aridity)),
      roadways_(textures, static_cast<float>(options.aridity)),
      parcels_(parcels),
      roads_(roads) {
  if (options.orthophoto.empty()) return;
  const GreyImage photo = LoadGrey(options.orthophoto);
  photo_ = std::make_unique<MipTexture>(photo, MipTexture::Edge::kClamp);
  photo_width_m_ = static_cast<float>(photo.cols * options.orthophoto_cell_m);
}

float GroundCover::Albedo(float x, float y, float height_m, float footprint_m) const {
  if (photo_) return PhotoAlbedo(x, y, footprint_m);
  GroundSpot spot{x, y, footprint_m, 0, 0};
  spot.middle = 1.3f * materials_.Detail(Material::kNoise, 0.96f * x + 0.28f * y,
                                         0.96f * y - 0.28f * x, 31, footprint_m);
  spot.large = 1.4f * materials_.Detail(Material::kNoise, x, y, 330, footprint_m);

  const RoadNetwork::Place road = roads_.Find(x, y);
  if (road.road != nullptr && road.edge_m < 0) return roadways_.Albedo(spot, road);
  const ParcelMap::Place place = parcels_.Find(x, y);
  const bool street = road.road != nullptr && road.road->road_class == RoadClass::kStreet;
  constexpr float kPavementM = 1.7f;
  if (street && place.parcel->in_town && road.edge_m < kPavementM)
    return roadways_.PavementAlbedo(spot, road);
  float albedo = FieldAlbedo(spot, *place.parcel, place.border_m);
  // Worn edges beside the road, and mud at the water.
  const float verge = 1 - SmoothStep(0, 1.1f + 0.8f * spot.middle, road.edge_m);
  albedo = Mix(albedo, kSoilTone * (1.1f + 0.4f * spot.middle), 0.7f * verge);
  const float shore = 1 - SmoothStep(0.25f, 0.8f + 0.3f * spot.middle, height_m);
  if (shore <= 0) return albedo;
  return Mix(albedo,
             kMudTone * (1 + 0.5f * materials_.Detail(Material::kGravel, x, y, 4, footprint_m)),
             shore);
}

float GroundCover::PhotoAlbedo(float x, float y, float footprint_m) const {
  const float u = x / photo_width_m_ + 0.5f;
  const float v = photo_->aspect() / 2 - y / photo_width_m_;
  const float level = photo_->Sample(u, v, footprint_m / photo_width_m_);
  // Photographs are written with a gamma of about 2.
  constexpr float kBrightest = 0.6f;
  const float fine = materials_.Detail(Material::kNoise, x, y, 6, footprint_m);
  return kBrightest * level * level * (1 + 0.25f * fine) + 0.01f;
}

float GroundCover::FieldAlbedo(const GroundSpot& spot, const Parcel& parcel, float border_m) const {
  const auto ax = static_cast<float>(parcel.along.x()), ay = static_cast<float>(parcel.along.y());
  const float dx = spot.x - static_cast<float>(parcel.centre.x());
  const float dy = spot.y - static_cast<float>(parcel.centre.y());
  const float u = ax * dx + ay * dy, v = ax * dy - ay * dx;
  float albedo = 0;
  switch (parcel.kind) {
    case ParcelKind::kMeadow:
      albedo = materials_.GrassAlbedo(spot, u, v);
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
      albedo = 0.11f * (1 + 0.5f * materials_.Detail(Material::kLeaves, u, v, 5, spot.footprint) +
                        0.3f * spot.middle);
      break;
    case ParcelKind::kOrchard:
      albedo = Mix(materials_.GrassAlbedo(spot, u, v), kSoilTone,
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
  return Mix(albedo, 0.85f * materials_.GrassAlbedo(spot, v, u), margin);
}

float GroundCover::CropAlbedo(const GroundSpot& spot, const Parcel& parcel, float u,
                              float v) const {
  const float period = parcel.seed % 2 == 0 ? 0.75f : 1.5f;
  const float leaves = materials_.Detail(Material::kLeaves, u, v, 2.7f, spot.footprint);
  const float soil = materials_.Detail(Material::kSoil, u, v, 3.3f, spot.footprint);
  // Plants of uneven size, with gaps where the noise is low.
  const float grown = std::clamp(0.55f + 0.35f * spot.middle, 0.05f, 0.95f);
  const float wander = 0.12f * spot.middle;
  const float plants = StripeCoverage(v + wander, period, period * grown, spot.footprint);
  return Mix(kSoilTone * (1.1f + 0.5f * soil), 0.15f * (1 + 0.6f * leaves), plants);
}

float GroundCover::WheatAlbedo(const GroundSpot& spot, const Parcel& parcel, float u,
                               float v) const {
  const float ears = materials_.Detail(Material::kGrass, v, u, 2.3f, spot.footprint);
  constexpr float kTramlinesM = 21, kGaugeM = 1.8f, kTyreM = 0.45f;
  const float wander = v + 0.25f * spot.middle;
  const float tracks = StripeCoverage(wander, kTramlinesM, kTyreM, spot.footprint) +
                       StripeCoverage(wander + kGaugeM, kTramlinesM, kTyreM, spot.footprint);
  const float tone = 0.22f + 0.12f * UnitFromHash(HashCell(1, 0, parcel.seed));
  // Places where wind laid the stalks down.
  const float laid =
      SmoothStep(0.35f, 0.5f, materials_.Detail(Material::kNoise, u, v, 43, spot.footprint));
  const float wheat = tone * (1 + 0.45f * ears + 0.22f * spot.middle) * (1 - 0.22f * laid);
  return Mix(wheat, kSoilTone * 0.8f, 0.8f * std::min(tracks, 1.0f));
}

float GroundCover::PloughedAlbedo(const GroundSpot& spot, const Parcel& parcel, float u,
                                  float v) const {
  const float clods = materials_.Detail(Material::kSoil, u, v, 3.7f, spot.footprint);
  const float wander = v + 0.2f * spot.middle;
  const float furrow = StripeCoverage(wander, 0.5f, 0.25f, spot.footprint);
  constexpr float kPassM = 3.5f;
  const float pass = UnitHash(std::floor(wander / kPassM), parcel.seed);
  const float pass_tone = (pass - 0.5f) * 0.3f * DetailVisibility(kPassM, spot.footprint);
  return 0.72f * kSoilTone *
         (1 + 0.5f * clods + 0.35f * spot.middle + 0.35f * (furrow - 0.5f) + pass_tone);
}

float GroundCover::StubbleAlbedo(const GroundSpot& spot, const Parcel& parcel, float u,
                                 float v) const {
  const float straw = materials_.Detail(Material::kGrass, u, v, 2.9f, spot.footprint);
  const float wander = v + 0.4f * spot.middle;
  const float swath = StripeCoverage(wander, 6, 1.4f, spot.footprint);
  const float rows = StripeCoverage(wander, 0.3f, 0.12f, spot.footprint);
  constexpr float kPassM = 6;
  const float pass = UnitHash(std::floor(wander / kPassM), parcel.seed) - 0.5f;
  const float pass_tone = 0.2f * pass * DetailVisibility(kPassM, spot.footprint);
  return kStrawTone * (0.8f + 0.3f * straw + 0.2f * spot.middle + pass_tone) *
         (1 + 0.3f * (swath - 0.25f) - 0.25f * (rows - 0.4f));
}

float GroundCover::GardenAlbedo(const GroundSpot& spot, const Parcel& parcel, float u,
                                float v) const {
  // Beds, terraces and gravel on a grid of cells that differ from plot to plot.
  const float cell_m = 2.2f + 1.6f * UnitFromHash(HashCell(3, 0, parcel.seed));
  const float lawn_stripe = StripeCoverage(v, 1.2f, 0.6f, spot.footprint) - 0.5f;
  const float lawn = materials_.GrassAlbedo(spot, u, v) * (1 + 0.12f * lawn_stripe);
  const float visibility = DetailVisibility(cell_m, spot.footprint);
  if (visibility <= 0) return lawn;
  const float cu = u + 0.5f * spot.middle, cv = v + 0.5f * spot.middle;
  const uint32_t hash = HashCell(static_cast<int32_t>(std::floor(cu / cell_m)),
                                 static_cast<int32_t>(std::floor(cv / cell_m)), parcel.seed);
  const float kind = UnitFromHash(hash);
  float cover = lawn;
  if (kind < 0.1f) {
    cover =
        kSoilTone * (0.7f + 0.6f * materials_.Detail(Material::kLeaves, u, v, 2, spot.footprint));
  } else if (kind < 0.22f) {
    cover = kPavementTone *
            (1 + 0.35f * materials_.Detail(Material::kPaving, u, v, 3.2f, spot.footprint));
  } else if (kind < 0.29f) {
    cover = 0.4f * (1 + 0.4f * materials_.Detail(Material::kGravel, u, v, 3, spot.footprint));
  }
  return Mix(lawn, cover, visibility);
}

float GroundCover::SquareAlbedo(const GroundSpot& spot, const Parcel& parcel, float u,
                                float v) const {
  if (parcel.seed % 2 == 0) {
    const float paving = materials_.Detail(Material::kPaving, u, v, 4.8f, spot.footprint);
    const float grid =
        StripeCoverage(u, 6, 0.5f, spot.footprint) + StripeCoverage(v, 6, 0.5f, spot.footprint);
    return kPavementTone * (1 + 0.35f * paving + 0.25f * spot.middle) *
           (1 - 0.35f * std::min(grid, 1.0f));
  }
  // A car park: bays of 2.5 m in rows of 5 m with lanes of 6 m between pairs.
  const float asphalt =
      kAsphaltTone * 1.1f *
      (1 + 0.35f * materials_.Detail(Material::kAsphalt, u, v, 4.3f, spot.footprint) +
       0.3f * spot.middle);
  constexpr float kRowsM = 16, kBaysM = 10, kLineM = 0.12f;
  const float bays = StripeCoverage(u, 2.5f, kLineM, spot.footprint) *
                     StripeCoverage(v, kRowsM, kBaysM, spot.footprint);
  const float middle = StripeCoverage(v - kBaysM / 2, kRowsM, kLineM, spot.footprint);
  return Mix(asphalt, kPaintTone, 0.85f * std::min(1.0f, bays + middle));
}

float GroundCover::DesertAlbedo(const GroundSpot& spot, const Parcel& parcel, float u,
                                float v) const {
  const float gravel = materials_.Detail(Material::kGravel, u, v, 3.9f, spot.footprint);
  const float stones =
      SmoothStep(0.1f, 0.6f, materials_.Detail(Material::kNoise, u, v, 57, spot.footprint));
  const float wander = v + 3 * spot.middle;
  const float ripple = StripeCoverage(wander, 0.9f, 0.45f, spot.footprint) - 0.5f;
  // Dry stream beds: thin lines where large noise changes sign.
  const float wadi =
      1 - SmoothStep(
              0.02f, 0.06f,
              std::abs(materials_.Detail(Material::kPlaster, spot.x, spot.y, 210, spot.footprint)));
  float albedo = kSandTone * (1 + 0.14f * spot.middle + 0.12f * (1 - stones) * ripple +
                              (0.12f + 0.35f * stones) * gravel);
  albedo *= 1 - 0.3f * wadi;
  if (parcel.kind == ParcelKind::kScrub) {
    const float dots =
        SmoothStep(0.35f, 0.5f, materials_.Detail(Material::kNoise, u, v + 5, 9, spot.footprint));
    albedo *= 1 - 0.5f * dots;
  }
  return albedo;
}

}  // namespace deepuav
