#pragma once

#include <vector>

#include "deepuav/simulation/world/buildings.h"
#include "deepuav/simulation/world/face_mesh.h"
#include "deepuav/simulation/world/road_network.h"
#include "deepuav/simulation/world/terrain.h"
#include "deepuav/simulation/world/water.h"

namespace deepuav {

/// Tables of equal panels that lean towards the south, in rows that follow the ground.
struct SolarPanels {
  FaceMesh mesh;
  std::vector<Footprint> footprints;
};

/// Over the square of `options.solar_panels_m` in the middle, but for roads, water and what is
/// `built` there. Empty for 0.
SolarPanels PlaceSolarPanels(const SceneOptions& options, const RoadNetwork& roads,
                             const Water& water, const Terrain& terrain,
                             const std::vector<Footprint>& built);

}  // namespace deepuav
