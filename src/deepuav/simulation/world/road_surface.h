#pragma once

#include "deepuav/simulation/world/ground_materials.h"
#include "deepuav/simulation/world/material_textures.h"
#include "deepuav/simulation/world/road_network.h"

namespace deepuav {

/// How light roads are: asphalt with its markings and mended places, gravel tracks, pavements.
/// Albedos are smoothed over the spot's footprint. Thread-safe.
class RoadSurface {
 public:
  /// As of GroundMaterials.
  RoadSurface(const MaterialTextures& textures, float aridity) : materials_(textures, aridity) {}

  /// At a place on a road.
  float Albedo(const GroundSpot& spot, const RoadNetwork::Place& place) const;
  /// At a place beside a street of a town.
  float PavementAlbedo(const GroundSpot& spot, const RoadNetwork::Place& place) const;

 private:
  float TrackAlbedo(const GroundSpot& spot, const RoadNetwork::Place& place) const;
  float Asphalt(const GroundSpot& spot, const RoadNetwork::Place& place) const;
  float Markings(const RoadNetwork::Place& place, float footprint) const;

  const GroundMaterials materials_;
};

}  // namespace deepuav
