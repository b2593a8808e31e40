#include "deepuav/simulation/world/world_geometry.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "deepuav/simulation/world/filtered_patterns.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

using Eigen::Vector3f;

constexpr float kWaterReachM = 6000;

SceneOptions Checked(const SceneOptions& options) {
  options.Check();
  return options;
}

bool IsProcedural(const SceneOptions& options) {
  return options.orthophoto.empty() && options.dem.empty();
}

// A user's own land comes without ours.
SceneOptions LandOptions(const SceneOptions& options) {
  SceneOptions land = options;
  if (!IsProcedural(options)) {
    land.river_width_m = land.lake_radius_m = 0;
    land.building_fraction = land.tree_fraction = land.forest_fraction = 0;
  }
  return land;
}

std::vector<RoadSite> RoadSites(const SceneOptions& options, const ParcelMap& parcels) {
  if (!IsProcedural(options)) return {};
  return parcels.road_sites();
}

Polyline OnGround(const std::vector<Eigen::Vector2d>& points, double width_m,
                  const Terrain& terrain) {
  Polyline line{{}, width_m};
  for (const Eigen::Vector2d& point : points) {
    line.points.emplace_back(point.x(), point.y(), terrain.Height(point.x(), point.y()));
  }
  return line;
}

}  // namespace

Outdoors::Outdoors(const SceneOptions& options, const MaterialTextures& textures)
    : water(options),
      parcels(options),
      roads(RoadSites(options, parcels), options.extent_m / 2,
            [&](const Eigen::Vector2d& point) { return water.InLake(point); }),
      terrain(options, water, roads),
      cover(options, textures, parcels, roads),
      traffic(options, roads, terrain) {}

WorldGeometry::WorldGeometry(const SceneOptions& options, const std::vector<Marker>& markers)
    : options_(LandOptions(Checked(options))),
      textures_(HashCell(options.seed, 8, 0x7e87u)),
      device_(MakeEmbreeDevice()),
      scene_(rtcNewScene(device_.get())) {
  if (options_.kind == "hall") {
    hall_ = MakeHall(options_);
    AddMesh(hall_->mesh);
  } else {
    AddOutdoors();
  }
  AddMarkers(markers);
  rtcCommitScene(scene_.get());
  CheckEmbree(device_.get(), "the static scene");
}

void WorldGeometry::Record(uint32_t number, Item item) {
  if (number >= items_.size()) items_.resize(number + 1);
  items_[number] = item;
}

void WorldGeometry::AddMesh(const FaceMesh& mesh) {
  if (mesh.triangles.empty()) return;
  const uint32_t number = AddTriangles(device_.get(), scene_.get(), mesh.vertices, mesh.triangles);
  Record(number, {Item::Kind::kMesh, &mesh, std::nullopt, 0});
}

void WorldGeometry::AddMarkers(const std::vector<Marker>& markers) {
  constexpr int kSubdivisions = 3;
  for (const Marker& marker : markers) {
    const auto radius = static_cast<float>(marker.radius_m);
    markers_.AddBall({marker.position.cast<float>(), {radius, radius, radius}, kSubdivisions, 0},
                     {Finish::kGlow, 1, 0});
  }
  AddMesh(markers_);
}

void WorldGeometry::AddOutdoors() {
  outdoors_.emplace(options_, textures_);
  const Outdoors& land = *outdoors_;
  const Terrain::Mesh ground = land.terrain.MakeMesh();
  Record(AddTriangles(device_.get(), scene_.get(), ground.vertices, ground.triangles),
         {Item::Kind::kTerrain, nullptr, std::nullopt, 0});
  if (land.water.any()) {
    constexpr float r = kWaterReachM;
    Record(AddTriangles(device_.get(), scene_.get(),
                        {{-r, -r, 0}, {r, -r, 0}, {r, r, 0}, {-r, r, 0}}, {{0, 1, 2}, {0, 2, 3}}),
           {Item::Kind::kWater, nullptr, std::nullopt, 0});
  }
  for (const Road& road : land.roads.roads()) {
    roads_.push_back(OnGround(road.points, 2 * road.half_width_m, land.terrain));
  }
  if (const auto line = land.water.RiverLine(); !line.empty()) {
    rivers_.push_back(OnGround(line, options_.river_width_m, land.terrain));
    for (Eigen::Vector3d& point : rivers_.back().points) point.z() = 0;
  }

  mover_meshes_ = Traffic::MakePrototypes();
  for (const FaceMesh& mesh : mover_meshes_) {
    mover_scenes_.push_back(MakePrototypeScene(device_.get(), mesh));
  }
  if (!IsProcedural(options_)) return;

  buildings_ = PlaceBuildings(options_, land.parcels, land.roads, land.water, land.terrain);
  AddMesh(buildings_.mesh);
  panels_ = PlaceSolarPanels(options_, land.roads, land.water, land.terrain, buildings_.footprints);
  AddMesh(panels_.mesh);
  std::vector<Footprint> covered = buildings_.footprints;
  covered.insert(covered.end(), panels_.footprints.begin(), panels_.footprints.end());
  plants_ = MakePlantPrototypes(HashCell(options_.seed, 9, 0x97a27u));
  for (const FaceMesh& mesh : plants_)
    plant_scenes_.push_back(MakePrototypeScene(device_.get(), mesh));
  const std::vector<Placed> placed =
      PlacePlants(options_, land.parcels, land.roads, land.water, land.terrain, covered);
  for (const Placed& plant : placed) {
    const Eigen::Matrix3f rotation =
        Eigen::AngleAxisf(plant.heading_rad, Vector3f::UnitZ()).toRotationMatrix();
    Placement placement;
    placement << plant.scale * rotation, plant.position;
    const auto prototype = static_cast<size_t>(plant.prototype);
    const uint32_t number =
        AddInstance(device_.get(), scene_.get(), plant_scenes_[prototype].get(), placement);
    Record(number, {Item::Kind::kMesh, &plants_[prototype], placements_.size(), number});
    placements_.push_back({rotation, plant.position, plant.scale});
  }
}

Vector3f WorldGeometry::WorldNormal(uint32_t geometry, const Vector3f& normal) const {
  const Item& item = items_[geometry];
  if (!item.placement) return normal;
  return placements_[*item.placement].rotation * normal;
}

Surface WorldGeometry::SurfaceAt(const SurfacePoint& point, float footprint_m) const {
  if (point.moving) {
    const Traffic::Mover& mover = outdoors_->traffic.movers()[point.geometry];
    const FaceMesh& mesh = mover_meshes_[static_cast<size_t>(mover.prototype)];
    const Face& face = mesh.faces[mesh.face_of_triangle[point.triangle]];
    return {FaceAppearance(textures_, face, point.object_position, point.object_normal, mover.seed,
                           footprint_m),
            point.geometric_normal};
  }
  const Item& item = items_[point.geometry];
  if (item.kind == Item::Kind::kTerrain) return TerrainSurface(point, footprint_m);
  if (item.kind == Item::Kind::kWater) return WaterSurface(point, footprint_m);
  const Face& face = item.mesh->faces[item.mesh->face_of_triangle[point.triangle]];
  if (!item.placement) {
    return {FaceAppearance(textures_, face, point.position, point.geometric_normal, 0, footprint_m),
            point.geometric_normal};
  }
  const PlacedMatrix& placed = placements_[*item.placement];
  const Vector3f inside =
      placed.rotation.transpose() * (point.position - placed.translation) / placed.scale;
  const Vector3f normal = placed.rotation.transpose() * point.geometric_normal;
  return {FaceAppearance(textures_, face, inside, normal, item.variant, footprint_m / placed.scale),
          point.geometric_normal};
}

Surface WorldGeometry::TerrainSurface(const SurfacePoint& point, float footprint_m) const {
  const Terrain& terrain = outdoors_->terrain;
  const float x = point.position.x(), y = point.position.y();
  const Eigen::Vector2f inside = terrain.Mirrored(x, y);
  Surface surface;
  surface.look.albedo =
      outdoors_->cover.Albedo(inside.x(), inside.y(), point.position.z(), footprint_m);
  const bool mirrored = inside.x() != x || inside.y() != y;
  surface.normal = mirrored ? point.geometric_normal : terrain.Normal(x, y);
  if (surface.normal.z() < 0) surface.normal = -surface.normal;
  return surface;
}

Surface WorldGeometry::WaterSurface(const SurfacePoint& point, float footprint_m) const {
  const float x = point.position.x(), y = point.position.y();
  const MipTexture& ripples = textures_[Material::kRipples];
  const auto slope = [&](float tile_m) {
    constexpr float kStep = 0.02f;
    const float u = x / tile_m, v = y / tile_m, width = std::max(footprint_m / tile_m, kStep);
    const float here = ripples.Sample(u, v, width);
    return Eigen::Vector2f(ripples.Sample(u + kStep, v, width) - here,
                           ripples.Sample(u, v + kStep, width) - here);
  };
  constexpr float kSteepness = 0.25f;
  const Eigen::Vector2f waves = kSteepness * (slope(5.3f) + 0.8f * slope(37));
  Surface surface;
  const float murk = textures_[Material::kNoise].Sample(x / 190, y / 190, footprint_m / 190);
  surface.look.albedo = 0.07f * (0.8f + 0.4f * murk);
  surface.look.reflectivity = 0.03f;
  surface.normal = Vector3f(-waves.x(), -waves.y(), 1).normalized();
  return surface;
}

std::optional<double> WorldGeometry::TopBelow(double x, double y, double from_height_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray.org_x = static_cast<float>(x);
  query.ray.org_y = static_cast<float>(y);
  query.ray.org_z = static_cast<float>(from_height_m);
  query.ray.dir_z = -1;
  query.ray.tfar = 1e6f;
  query.ray.mask = ~0u;
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_.get(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return from_height_m - query.ray.tfar;
}

}  // namespace deepuav
