#include "deepuav/simulation/world/surface.h"

#include <algorithm>
#include <cmath>

#include "deepuav/simulation/world/filtered_patterns.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kGlassTone = 0.05f, kGlassReflectivity = 0.12f;

// A point on a flat face, and what its look is made of.
struct Spot {
  const MaterialTextures& textures;
  const Face& face;
  float u, v;
  float footprint;
  uint32_t variant;

  float Detail(Material material, float tile_m) const {
    const float shift = UnitFromHash(HashCell(0, 1, face.seed));
    return 2 * textures[material].Sample(u / tile_m + shift, v / tile_m, footprint / tile_m) - 1;
  }
  float Chance(int32_t i, int32_t j) const { return UnitFromHash(HashCell(i, j, face.seed)); }
};

float WallAlbedo(const Spot& spot) {
  const float tone = spot.face.tone;
  const float stains = spot.Detail(Material::kNoise, 11);
  // Splashes at the foot, and rain streaks below the eaves.
  const float weathering =
      1 - 0.25f * (1 - SmoothStep(0.1f, 1.2f, spot.v + 0.4f * stains)) -
      0.15f * SmoothStep(spot.face.height_m - 0.8f, spot.face.height_m, spot.v);
  switch (spot.face.finish) {
    case Finish::kBrickWall:
      return 0.65f * tone * weathering *
             (1 + 0.4f * spot.Detail(Material::kBricks, 1.6f) + 0.2f * stains);
    case Finish::kConcreteWall:
      return tone * weathering *
             (1 + 0.25f * spot.Detail(Material::kConcrete, 5.8f) + 0.15f * stains);
    default:
      return tone * weathering *
             (1 + 0.12f * spot.Detail(Material::kPlaster, 2.3f) + 0.2f * stains);
  }
}

// Panes, frames, sills and blinds on a grid of storeys and bays, or a door in place of the first
// window.
Appearance WindowedWall(const Spot& spot) {
  Appearance look{WallAlbedo(spot)};
  constexpr float kStoreyM = 2.9f, kSillM = 0.95f, kWindowM = 1.35f, kFrameM = 0.08f;
  const float bay = 2.3f + 1.1f * spot.Chance(11, 0), width = 0.9f + 0.5f * spot.Chance(12, 0);
  const float bays = std::floor(spot.face.width_m / bay);
  if (bays < 1) return look;
  const float cell_width = spot.face.width_m / bays;
  // Storeys are counted from the eaves, for the foot is in the ground.
  const float from_top = spot.face.height_m - spot.v;
  const float column = std::clamp(std::floor(spot.u / cell_width), 0.0f, bays - 1);
  const float storey = std::floor(from_top / kStoreyM);
  const float x = spot.u - (column + 0.5f) * cell_width;
  const float y = kStoreyM - (from_top - storey * kStoreyM) - kSillM;
  const auto i = static_cast<int32_t>(column), j = static_cast<int32_t>(storey);
  if (spot.Chance(i, j + 100) < 0.12f) return look;
  const bool ground_floor = from_top + kStoreyM > spot.face.height_m;
  const bool door = ground_floor && spot.Chance(i, 200) < 0.25f;
  const float low = door ? -kSillM : 0, high = kWindowM, half = width / 2;

  const float outer = BandCoverage(-half - kFrameM, half + kFrameM, x, spot.footprint) *
                      BandCoverage(low - kFrameM, high + kFrameM, y, spot.footprint);
  const float pane_x =
      BandCoverage(-half, -0.03f, x, spot.footprint) + BandCoverage(0.03f, half, x, spot.footprint);
  const float pane = pane_x * BandCoverage(low, high, y, spot.footprint);
  const float frame_tone = spot.Chance(13, 0) < 0.7f ? 0.75f : 0.12f;
  look.albedo = Mix(look.albedo, frame_tone, outer);
  const float blind = spot.Chance(i, j + 300) * 1.6f - 0.6f;
  const float behind = y > high * (1 - blind) ? 0.45f : kGlassTone;
  look.albedo = Mix(look.albedo, door ? 0.16f : behind, pane);
  look.reflectivity = door ? 0 : kGlassReflectivity * pane;
  const float sill = BandCoverage(-half - 0.15f, half + 0.15f, x, spot.footprint) *
                     BandCoverage(low - 0.16f, low - 0.06f, y, spot.footprint);
  look.albedo = Mix(look.albedo, 0.7f, door ? 0 : sill);
  return look;
}

Appearance TiledRoof(const Spot& spot) {
  const float tiles = spot.Detail(Material::kRoofTiles, 4.8f);
  const float moss = spot.Detail(Material::kNoise, 9);
  Appearance look{spot.face.tone * (1 + 0.38f * tiles + 0.3f * moss)};
  const float chance = spot.Chance(1, 1);
  const float along = spot.u / spot.face.width_m, up = spot.v / spot.face.height_m;
  const float fu = spot.footprint / spot.face.width_m, fv = spot.footprint / spot.face.height_m;
  if (chance < 0.25f) {  // Solar panels.
    const float panels = BandCoverage(0.2f, 0.75f, along, fu) * BandCoverage(0.25f, 0.8f, up, fv);
    const float seams = std::min(1.0f, StripeCoverage(spot.u, 1, 0.06f, spot.footprint) +
                                           StripeCoverage(spot.v, 1.6f, 0.06f, spot.footprint));
    look.albedo = Mix(look.albedo, Mix(0.05f, 0.4f, seams), panels);
    look.reflectivity = 0.06f * panels;
  } else if (chance < 0.7f) {  // Roof windows.
    const float at = 0.2f + 0.5f * spot.Chance(2, 1);
    const float w = 0.45f / spot.face.width_m, h = 0.65f / spot.face.height_m;
    const float frame = BandCoverage(at - 1.25f * w, at + 1.25f * w, along, fu) *
                        BandCoverage(0.5f - 1.2f * h, 0.5f + 1.2f * h, up, fv);
    const float pane =
        BandCoverage(at - w, at + w, along, fu) * BandCoverage(0.5f - h, 0.5f + h, up, fv);
    look.albedo = Mix(Mix(look.albedo, 0.35f, frame), kGlassTone, pane);
    look.reflectivity = kGlassReflectivity * pane;
  }
  return look;
}

// Of 1 x 2 m, all equal but for their tone and dust.
Appearance SolarPanels(const Spot& spot) {
  constexpr float kWidthM = 1, kHeightM = 2, kFrameM = 0.05f, kCellM = kWidthM / 6;
  constexpr float kCellGapM = 0.012f, kFrameTone = 0.55f, kGapTone = 0.12f;
  const float panel = spot.Chance(static_cast<int32_t>(std::floor(spot.u / kWidthM)),
                                  static_cast<int32_t>(std::floor(spot.v / kHeightM)));
  const float dust = 1 + 0.25f * spot.Detail(Material::kNoise, 6.7f);
  const float gaps = std::min(1.0f, StripeCoverage(spot.u, kCellM, kCellGapM, spot.footprint) +
                                        StripeCoverage(spot.v, kCellM, kCellGapM, spot.footprint));
  const float frames =
      std::min(1.0f, StripeCoverage(spot.u, kWidthM, kFrameM, spot.footprint) +
                         StripeCoverage(spot.v, kHeightM, kFrameM, spot.footprint));
  const float cells = Mix(spot.face.tone * (0.85f + 0.3f * panel), kGapTone, gaps);
  return {dust * Mix(cells, kFrameTone, frames), 0.04f * (1 - frames), 0, 0};
}

Appearance Print(const Spot& spot) {
  const uint32_t page = HashCell(5, static_cast<int32_t>(spot.variant), spot.face.seed);
  const auto column = static_cast<float>(page % 4), row = static_cast<float>((page / 4) % 4);
  // Stretched over the face; the texture's rows run downwards.
  const float u = std::clamp(spot.u / spot.face.width_m, 0.01f, 0.99f);
  const float v = std::clamp(1 - spot.v / spot.face.height_m, 0.01f, 0.99f);
  const float footprint = spot.footprint / std::max(spot.face.width_m, spot.face.height_m);
  const float level =
      spot.textures[Material::kPrint].Sample((column + u) / 4, (row + v) / 4, footprint / 4);
  return {0.03f + 0.85f * SmoothStep(0.1f, 0.9f, level)};
}

Appearance HallFloor(const Spot& spot) {
  const float slabs = spot.Detail(Material::kConcrete, 6.1f),
              stains = spot.Detail(Material::kNoise, 14);
  const float marks = spot.Detail(Material::kAsphalt, 3.9f);
  Appearance look{spot.face.tone * (1 + 0.3f * slabs + 0.25f * stains + 0.15f * marks)};
  constexpr float kTileM = 0.8f, kJointM = 0.025f;
  const float tile = spot.Chance(static_cast<int32_t>(std::floor(spot.u / kTileM)),
                                 static_cast<int32_t>(std::floor(spot.v / kTileM)));
  look.albedo *= 1 + 0.5f * (tile - 0.5f) * DetailVisibility(kTileM, spot.footprint);
  const float joints = std::min(1.0f, StripeCoverage(spot.u, kTileM, kJointM, spot.footprint) +
                                          StripeCoverage(spot.v, kTileM, kJointM, spot.footprint));
  look.albedo *= 1 - 0.6f * joints;
  const float worn = std::clamp(0.9f + 0.4f * marks, 0.0f, 1.0f);
  const float lines = std::min(1.0f, StripeCoverage(spot.u - 2, 8, 0.1f, spot.footprint) +
                                         StripeCoverage(spot.v - 3, 6.4f, 0.1f, spot.footprint));
  look.albedo = Mix(look.albedo, 0.65f, lines * worn);
  return look;
}

Appearance HallWall(const Spot& spot) {
  const float stains = spot.Detail(Material::kNoise, 10);
  const float panels = StripeCoverage(spot.u, 1, 0.03f, spot.footprint);
  const float band = BandCoverage(0, 1.2f, spot.v, spot.footprint);
  const float tone =
      spot.face.tone * (1 + 0.15f * spot.Detail(Material::kPlaster, 2.7f) + 0.2f * stains);
  return {tone * (1 - 0.4f * panels) * (1 - 0.45f * band)};
}

Appearance CarPaint(const Spot& spot) {
  const float chosen =
      UnitFromHash(HashCell(1, static_cast<int32_t>(spot.face.seed), spot.variant));
  // Most cars are white, grey or black.
  const float tone =
      chosen < 0.35f ? 0.7f : (chosen < 0.65f ? 0.06f + 0.1f * chosen : 0.9f * (chosen - 0.4f));
  const float seams = std::min(1.0f, StripeCoverage(spot.u - 0.9f, 1.1f, 0.02f, spot.footprint));
  return {tone * (1 - 0.6f * seams), 0.05f, 0, 0};
}

Appearance Cloth(const Spot& spot) {
  const float tone =
      0.1f + 0.6f * UnitFromHash(HashCell(2, static_cast<int32_t>(spot.face.seed), spot.variant));
  const float stripes = StripeCoverage(spot.v, 0.2f, 0.1f, spot.footprint);
  return {Mix(tone, 0.9f - tone, (spot.variant % 3 == 0 ? 0.8f : 0.2f) * stripes)};
}

// Texture of round things, read on the plane that faces the point most.
float RoundDetail(const MaterialTextures& textures, Material material, const Vector3f& point,
                  const Vector3f& normal, float tile_m, float footprint_m) {
  Vector3f::Index axis;
  normal.cwiseAbs().maxCoeff(&axis);
  const Vector2f at(point[(axis + 1) % 3], point[(axis + 2) % 3]);
  return 2 * textures[material].Sample(at.x() / tile_m, at.y() / tile_m, footprint_m / tile_m) - 1;
}

Appearance Leaves(const MaterialTextures& textures, const Face& face, const Vector3f& point,
                  const Vector3f& normal, uint32_t variant, float footprint_m) {
  const float leaves = RoundDetail(textures, Material::kLeaves, point, normal, 1.9f, footprint_m);
  const float clumps = RoundDetail(textures, Material::kNoise, point, normal, 5.3f, footprint_m);
  const float tree = 0.7f + 0.6f * UnitFromHash(HashCell(3, 0, variant));
  // Light seldom reaches the folds between clumps and the underside.
  const Vector3f out = point - face.origin;
  const float depth = face.width_m > 0 ? 2 * out.norm() / face.width_m : 1;
  const float open = std::clamp(0.15f + 0.85f * (depth - 0.6f) / 0.5f, 0.15f, 1.2f);
  return {face.tone * tree * open * (1 + 0.85f * leaves + 0.5f * clumps), 0, 0.3f, 0};
}

}  // namespace

Appearance FaceAppearance(const MaterialTextures& textures, const Face& face, const Vector3f& point,
                          const Vector3f& normal, uint32_t variant, float footprint_m) {
  const Vector3f offset = point - face.origin;
  const Spot spot{textures,    face,   face.u_axis.dot(offset), face.v_axis.dot(offset),
                  footprint_m, variant};
  switch (face.finish) {
    case Finish::kPlasterWall:
    case Finish::kBrickWall:
    case Finish::kConcreteWall:
      return WindowedWall(spot);
    case Finish::kBlankWall:
      return {WallAlbedo(spot)};
    case Finish::kTiledRoof:
      return TiledRoof(spot);
    case Finish::kFlatRoof:
      return {face.tone * 1.3f *
              (1 + 0.35f * spot.Detail(Material::kGravel, 3.7f) +
               0.35f * spot.Detail(Material::kNoise, 17))};
    case Finish::kMetalRoof: {
      const float ribs = StripeCoverage(spot.u, 0.4f, 0.08f, footprint_m);
      return {face.tone * (1 - 0.4f * ribs) * (1 + 0.3f * spot.Detail(Material::kNoise, 8)), 0.04f,
              0, 0};
    }
    case Finish::kSolarPanels:
      return SolarPanels(spot);
    case Finish::kPrint:
      return Print(spot);
    case Finish::kPlanks:
      return {face.tone * (1 + 0.4f * spot.Detail(Material::kPlanks, 1.7f))};
    case Finish::kPaint:
      return CarPaint(spot);
    case Finish::kGlass:
      return {kGlassTone, kGlassReflectivity, 0, 0};
    case Finish::kDark:
      return {face.tone * (1 + 0.3f * spot.Detail(Material::kNoise, 2))};
    case Finish::kCloth:
      return Cloth(spot);
    case Finish::kHallFloor:
      return HallFloor(spot);
    case Finish::kHallWall:
      return HallWall(spot);
    case Finish::kLeaves:
      return Leaves(textures, face, point, normal, variant, footprint_m);
    case Finish::kBark:
      return {face.tone * (1 + 0.4f * RoundDetail(textures, Material::kPlanks, point, normal, 1.3f,
                                                  footprint_m))};
    case Finish::kRock:
      return {face.tone * (1 + 0.5f * RoundDetail(textures, Material::kNoise, point, normal, 2.7f,
                                                  footprint_m))};
    case Finish::kStraw:
      return {face.tone * (1 + 0.4f * RoundDetail(textures, Material::kGrass, point, normal, 1.7f,
                                                  footprint_m))};
    case Finish::kGlow:
      return {0, 0, 0, face.tone};
  }
  return {};
}

}  // namespace deepuav
