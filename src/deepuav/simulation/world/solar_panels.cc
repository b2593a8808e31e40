#include "deepuav/simulation/world/solar_panels.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;

constexpr double kRowPitchM = 7, kTableLengthM = 20, kTableGapM = 0.3, kPanelsLengthM = 4;
constexpr double kTiltRad = 20 * std::numbers::pi / 180, kLowEdgeM = 0.8;
constexpr float kTone = 0.05f;

bool IsFree(const Footprint& table, const RoadNetwork& roads, const Water& water,
            const std::vector<Footprint>& built) {
  constexpr float kFromRoadM = 2, kFromShoreM = 4;
  constexpr double kFromHouseM = 3;  // And none fits in between.
  for (const double u : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    for (const double v : {-1.0, 1.0}) {
      const auto x = static_cast<float>(table.centre.x() + u * table.half_length_m);
      const auto y = static_cast<float>(table.centre.y() + v * table.half_width_m);
      if (roads.Find(x, y).edge_m < kFromRoadM || water.ShoreDistance(x, y) < kFromShoreM)
        return false;
      const auto is_built = [&](const Footprint& one) { return one.Covers({x, y}, kFromHouseM); };
      if (std::ranges::any_of(built, is_built)) return false;
    }
  }
  return true;
}

void AddTable(const Footprint& table, const Terrain& terrain, uint32_t seed, FaceMesh* mesh) {
  const auto corner = [&](double u, double v) {
    const double x = table.centre.x() + u * table.half_length_m;
    const double rise = (v + 1) * table.half_width_m * std::tan(kTiltRad);
    return Vector3f(static_cast<float>(x),
                    static_cast<float>(table.centre.y() + v * table.half_width_m),
                    static_cast<float>(terrain.Height(x, table.centre.y()) + kLowEdgeM + rise));
  };
  mesh->AddQuad(corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1),
                {Finish::kSolarPanels, kTone, seed});
}

}  // namespace

SolarPanels PlaceSolarPanels(const SceneOptions& options, const RoadNetwork& roads,
                             const Water& water, const Terrain& terrain,
                             const std::vector<Footprint>& built) {
  SolarPanels panels;
  constexpr double kFromBorderM = 3;
  const double half = std::min(options.solar_panels_m, options.extent_m - 2 * kFromBorderM) / 2,
               half_width = kPanelsLengthM / 2 * std::cos(kTiltRad);
  for (double y = -half; y + kRowPitchM <= half; y += kRowPitchM) {
    for (double x = -half; x + kTableLengthM <= half; x += kTableLengthM + kTableGapM) {
      const Footprint table{{x + kTableLengthM / 2, y + kRowPitchM / 2},
                            Vector2d::UnitX(),
                            kTableLengthM / 2,
                            half_width};
      if (!IsFree(table, roads, water, built)) continue;
      AddTable(table, terrain, static_cast<uint32_t>(panels.footprints.size()), &panels.mesh);
      panels.footprints.push_back(table);
    }
  }
  return panels;
}

}  // namespace deepuav
