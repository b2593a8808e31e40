#pragma once

#include <memory>

#include "deepuav/simulation/world/ground_materials.h"
#include "deepuav/simulation/world/material_textures.h"
#include "deepuav/simulation/world/parcels.h"
#include "deepuav/simulation/world/road_network.h"
#include "deepuav/simulation/world/road_surface.h"
#include "deepuav/simulation/world/scene_options.h"

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
  float FieldAlbedo(const GroundSpot& spot, const Parcel& parcel, float border_m) const;
  float CropAlbedo(const GroundSpot& spot, const Parcel& parcel, float u, float v) const;
  float WheatAlbedo(const GroundSpot& spot, const Parcel& parcel, float u, float v) const;
  float PloughedAlbedo(const GroundSpot& spot, const Parcel& parcel, float u, float v) const;
  float StubbleAlbedo(const GroundSpot& spot, const Parcel& parcel, float u, float v) const;
  float GardenAlbedo(const GroundSpot& spot, const Parcel& parcel, float u, float v) const;
  float SquareAlbedo(const GroundSpot& spot, const Parcel& parcel, float u, float v) const;
  float DesertAlbedo(const GroundSpot& spot, const Parcel& parcel, float u, float v) const;
  float PhotoAlbedo(float x, float y, float footprint_m) const;

  const GroundMaterials materials_;
  const RoadSurface roadways_;
  const ParcelMap& parcels_;
  const RoadNetwork& roads_;
  std::unique_ptr<const MipTexture> photo_;
  float photo_width_m_ = 0;
};

}  // namespace deepuav
