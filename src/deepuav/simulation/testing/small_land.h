#pragma once

#include "deepuav/simulation/world/buildings.h"
#include "deepuav/simulation/world/road_network.h"
#include "deepuav/simulation/world/terrain.h"

namespace deepuav {

inline SceneOptions SmallVillage() {
  SceneOptions options;
  options.extent_m = 500;
  options.town_radius_m = 90;
  options.lake_radius_m = 40;
  return options;
}

/// Grass without hills, water, houses or plants, 2 m high everywhere.
inline SceneOptions FlatLand() {
  SceneOptions options;
  options.extent_m = 200;
  options.relief_m = 0;
  options.town_radius_m = 0;
  options.building_fraction = options.tree_fraction = options.forest_fraction = 0;
  options.river_width_m = options.lake_radius_m = 0;
  options.cars_per_km = options.people_per_km = 0;
  return options;
}
inline constexpr double kFlatLandHeightM = 2;

/// What the land is made of, without tracing.
struct Land {
  explicit Land(const SceneOptions& scene)
      : options(scene),
        water(options),
        parcels(options),
        roads(parcels.road_sites(), options.extent_m / 2,
              [&](const Eigen::Vector2d& point) { return water.InLake(point); }),
        terrain(options, water, roads) {}

  SceneOptions options;
  Water water;
  ParcelMap parcels;
  RoadNetwork roads;
  Terrain terrain;
};

}  // namespace deepuav
