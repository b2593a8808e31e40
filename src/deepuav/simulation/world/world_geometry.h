#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "deepuav/simulation/rendering/embree_scene.h"
#include "deepuav/simulation/world/ground_cover.h"
#include "deepuav/simulation/world/hall.h"
#include "deepuav/simulation/world/material_textures.h"
#include "deepuav/simulation/world/solar_panels.h"
#include "deepuav/simulation/world/surface.h"
#include "deepuav/simulation/world/traffic.h"
#include "deepuav/simulation/world/vegetation.h"
#include "deepuav/simulation/world/world.h"

namespace deepuav {

/// The land, where the scene is out of doors.
struct Outdoors {
  Outdoors(const SceneOptions& options, const MaterialTextures& textures);

  Water water;
  ParcelMap parcels;
  RoadNetwork roads;
  Terrain terrain;
  GroundCover cover;
  Traffic traffic;
};

/// A point of a surface that a ray met.
struct SurfacePoint {
  Eigen::Vector3f position;          ///< World.
  Eigen::Vector3f geometric_normal;  ///< World, unit, either side.
  uint32_t geometry;                 ///< Number in the static scene; of the mover, where moving.
  uint32_t triangle;
  bool moving = false;
  Eigen::Vector3f object_position;  ///< In the mesh's own frame; set for movers only.
  Eigen::Vector3f object_normal;
};

/// A surface as light falls on it.
struct Surface {
  Appearance look;
  Eigen::Vector3f normal;  ///< World, unit, smooth, outwards or either side.
};

/// Everything that is traced and shaded. Const after construction.
class WorldGeometry {
 public:
  WorldGeometry(const SceneOptions& options, const std::vector<Marker>& markers);

  const SceneOptions& options() const { return options_; }
  const MaterialTextures& textures() const { return textures_; }
  const Outdoors* outdoors() const { return outdoors_ ? &*outdoors_ : nullptr; }
  const Hall* hall() const { return hall_ ? &*hall_ : nullptr; }

  RTCDevice device() const { return device_.get(); }
  RTCScene static_scene() const { return scene_.get(); }
  RTCScene mover_scene(int prototype) const {
    return mover_scenes_[static_cast<size_t>(prototype)].get();
  }

  Surface SurfaceAt(const SurfacePoint& point, float footprint_m) const;

  /// The highest surface of the static scene at a place, looking down from `from_height_m`.
  std::optional<double> TopBelow(double x, double y, double from_height_m) const;

  /// The rotation of the static geometry that has this number: its normals are in its own frame.
  Eigen::Vector3f WorldNormal(uint32_t geometry, const Eigen::Vector3f& normal) const;

  const std::vector<Polyline>& roads() const { return roads_; }
  const std::vector<Polyline>& rivers() const { return rivers_; }

 private:
  // What the static scene's geometries are, by their numbers.
  struct Item {
    enum class Kind { kTerrain, kWater, kMesh } kind;
    const FaceMesh* mesh = nullptr;
    std::optional<size_t> placement;  // Of an instance.
    uint32_t variant = 0;
  };
  struct PlacedMatrix {
    Eigen::Matrix3f rotation;  // Without the scale.
    Eigen::Vector3f translation;
    float scale;
  };

  void AddOutdoors();
  void AddMarkers(const std::vector<Marker>& markers);
  void AddMesh(const FaceMesh& mesh);
  void Record(uint32_t number, Item item);
  Surface TerrainSurface(const SurfacePoint& point, float footprint_m) const;
  Surface WaterSurface(const SurfacePoint& point, float footprint_m) const;

  SceneOptions options_;
  MaterialTextures textures_;
  std::optional<Outdoors> outdoors_;
  std::optional<Hall> hall_;
  Buildings buildings_;
  SolarPanels panels_;
  FaceMesh markers_;
  std::vector<FaceMesh> plants_;
  std::vector<FaceMesh> mover_meshes_;
  std::vector<PlacedMatrix> placements_;
  std::vector<Item> items_;
  std::vector<Polyline> roads_, rivers_;

  EmbreeDevice device_;
  std::vector<EmbreeScene> plant_scenes_, mover_scenes_;
  EmbreeScene scene_;
};

}  // namespace deepuav
