#pragma once

#include <memory>

#include "deepuav/simulation/world/material_textures.h"
#include "deepuav/simulation/world/parcels.h"
#include "deepuav/simulation/world/road_network.h"

namespace deepuav {

/// How light the ground is, place by place.
class GroundCover {
 public:
  /// All must outlive it. With an orthophoto in the options, that is the ground, with noise finer
  /// than its pixels.
  GroundCover(const SceneOptions& options, const MaterialTextures& textures,
              const ParcelMap& parcels, const RoadNetwork& roads);

  /// Albedo at a place, smoothed over `footprint_m`. `height_m` is that above the water.
  float Albedo(float x, float y, float height_m, float footprint_m) const;

 private:
  // A place with what all covers need of it.
  struct Spot {
    float x, y;
    float footprint;
    float middle, large;  // Noise of about a metre to 30 m and up to 300 m, -1 to 1.
  };

  float Detail(Material material, float u, float v, float tile_m, float footprint) const {
    return 2 * textures_[material].Sample(u / tile_m, v / tile_m, footprint / tile_m) - 1;
  }
  float FieldAlbedo(const Spot& spot, const Parcel& parcel, float border_m) const;
  float CropAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const;
  float WheatAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const;
  float PloughedAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const;
  float StubbleAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const;
  float GardenAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const;
  float SquareAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const;
  float DesertAlbedo(const Spot& spot, const Parcel& parcel, float u, float v) const;
  float GrassAlbedo(const Spot& spot, float u, float v) const;
  float RoadAlbedo(const Spot& spot, const RoadNetwork::Place& place) const;
  float TrackAlbedo(const Spot& spot, const RoadNetwork::Place& place) const;
  float Asphalt(const Spot& spot, const RoadNetwork::Place& place) const;
  float Markings(const RoadNetwork::Place& place, float footprint) const;
  float PavementAlbedo(const Spot& spot, const RoadNetwork::Place& place) const;
  float PhotoAlbedo(float x, float y, float footprint_m) const;

  const MaterialTextures& textures_;
  const ParcelMap& parcels_;
  const RoadNetwork& roads_;
  float aridity_;
  std::unique_ptr<const MipTexture> photo_;
  float photo_width_m_ = 0;
};

}  // namespace deepuav
