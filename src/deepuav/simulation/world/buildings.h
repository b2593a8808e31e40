#pragma once

#include <vector>

#include "deepuav/simulation/world/face_mesh.h"
#include "deepuav/simulation/world/parcels.h"
#include "deepuav/simulation/world/road_network.h"
#include "deepuav/simulation/world/terrain.h"

namespace deepuav {

/// The ground that a building covers, for what must not grow there.
struct Footprint {
  Eigen::Vector2d centre, along;
  double half_length_m, half_width_m;

  bool Covers(const Eigen::Vector2d& point, double margin_m) const;
};

/// Houses, sheds and their chimneys on the plots of the town.
struct Buildings {
  FaceMesh mesh;
  std::vector<Footprint> footprints;
};

Buildings PlaceBuildings(const SceneOptions& options, const ParcelMap& parcels,
                         const RoadNetwork& roads, const Water& water, const Terrain& terrain);

}  // namespace deepuav
