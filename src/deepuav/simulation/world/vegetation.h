#pragma once

#include <vector>

#include "deepuav/simulation/world/buildings.h"
#include "deepuav/simulation/world/face_mesh.h"
#include "deepuav/simulation/world/parcels.h"
#include "deepuav/simulation/world/road_network.h"
#include "deepuav/simulation/world/terrain.h"

namespace deepuav {

/// A mesh that stands in many places.
struct Placed {
  int prototype;
  Eigen::Vector3f position;
  float heading_rad;
  float scale;
};

/// Trees, bushes, rocks, bales and poles, about their foot; made once and placed many times.
std::vector<FaceMesh> MakePlantPrototypes(uint32_t seed);

/// Where they stand: woods, orchards, gardens, hedges, along roads, and rocks where it is dry.
std::vector<Placed> PlacePlants(const SceneOptions& options, const ParcelMap& parcels,
                                const RoadNetwork& roads, const Water& water,
                                const Terrain& terrain, const std::vector<Footprint>& footprints);

}  // namespace deepuav
