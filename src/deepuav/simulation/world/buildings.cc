#include "deepuav/simulation/world/buildings.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/random.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;

constexpr float kStoreyM = 2.9f;
constexpr float kEavesM = 0.45f;

// A house in the making: its plan, and the frame of its walls.
struct House {
  Vector3f base;  // Middle of the plan, at the lowest ground.
  Vector3f along, across;
  float length, width, height;  // Of the walls.
  FaceMesh::Look walls, roof;

  Vector3f At(float u, float v, float z) const {
    return base + u * along + v * across + Vector3f(0, 0, z);
  }
};

void AddWalls(const House& house, FaceMesh* mesh) {
  const float l = house.length / 2, w = house.width / 2, h = house.height;
  const float corners[4][2] = {{-l, -w}, {l, -w}, {l, w}, {-l, w}};
  for (int i = 0; i < 4; ++i) {
    const float* a = corners[i];
    const float* b = corners[(i + 1) % 4];
    FaceMesh::Look look = house.walls;
    look.seed = HashCell(i, 1, house.walls.seed);
    mesh->AddQuad(house.At(a[0], a[1], 0), house.At(b[0], b[1], 0), house.At(b[0], b[1], h),
                  house.At(a[0], a[1], h), look);
  }
}

void AddChimney(const House& house, float u, float v, float top, FaceMesh* mesh) {
  const FaceMesh::Look sides{Finish::kBlankWall, 0.3f, house.walls.seed + 5};
  mesh->AddBox(
      {house.At(u, v, house.height - 0.5f), house.along, 0.9f, 0.6f, top - house.height + 1.2f},
      sides, {Finish::kDark, 0.08f, 0});
}

void AddDormer(const House& house, float u, float side, float rise, FaceMesh* mesh) {
  const float v = side * house.width * 0.28f;
  const FaceMesh::Look sides{Finish::kBlankWall, house.walls.tone, house.walls.seed + 9};
  mesh->AddBox({house.At(u, v, house.height + 0.1f * rise), house.along, 1.7f, 1.6f, 0.62f * rise},
               sides, {Finish::kMetalRoof, 0.25f, 0});
  const float front = v + side * 0.81f;
  const float low = house.height + 0.35f * rise, high = house.height + 0.66f * rise;
  mesh->AddQuad(house.At(u - 0.6f, front, low), house.At(u + 0.6f, front, low),
                house.At(u + 0.6f, front, high), house.At(u - 0.6f, front, high),
                {Finish::kGlass, 0.06f, 0});
}

// A gable roof, or hipped when `hip` (length of the ridge's retreat) is not 0.
void AddPitchedRoof(const House& house, float rise, float hip, FaceMesh* mesh) {
  const float l = house.length / 2, w = house.width / 2, h = house.height;
  const float slope = rise / w;
  const float lo = l + kEavesM, wo = w + kEavesM, low = h - kEavesM * slope, top = h + rise;
  const float ridge = std::max(0.5f, lo - hip);
  const float thickness = 0.12f;
  for (const float side : {-1.0f, 1.0f}) {
    const float ends = -side;  // Keeps the faces' u axis running with the outside on the right.
    mesh->AddQuad(house.At(ends * -lo, side * wo, low + thickness),
                  house.At(ends * lo, side * wo, low + thickness),
                  house.At(ends * ridge, 0, top + thickness),
                  house.At(ends * -ridge, 0, top + thickness), house.roof);
  }
  for (const float end : {-1.0f, 1.0f}) {
    if (hip > 0) {
      mesh->AddTriangle(house.At(end * lo, -end * wo, low + thickness),
                        house.At(end * lo, end * wo, low + thickness),
                        house.At(end * ridge, 0, top + thickness), house.roof);
    } else {
      mesh->AddTriangle(house.At(end * l, -end * w, h), house.At(end * l, end * w, h),
                        house.At(end * l, 0, top),
                        {Finish::kBlankWall, house.walls.tone, house.walls.seed});
    }
  }
}

void AddFlatRoof(const House& house, Random* random, FaceMesh* mesh) {
  const float l = house.length / 2, w = house.width / 2, h = house.height;
  mesh->AddQuad(house.At(-l, -w, h - 0.5f), house.At(l, -w, h - 0.5f), house.At(l, w, h - 0.5f),
                house.At(-l, w, h - 0.5f), {Finish::kFlatRoof, house.roof.tone, house.roof.seed});
  const FaceMesh::Look parapet{Finish::kBlankWall, 0.9f * house.walls.tone, house.walls.seed};
  for (const float side : {-1.0f, 1.0f}) {
    mesh->AddBox({house.At(0, side * (w - 0.15f), h - 0.6f), house.along, house.length, 0.3f, 0.7f},
                 parapet, parapet);
    mesh->AddBox({house.At(side * (l - 0.15f), 0, h - 0.6f), house.along, 0.3f, house.width, 0.7f},
                 parapet, parapet);
  }
  const int boxes = 1 + static_cast<int>(house.length * house.width / 60);
  for (int i = 0; i < boxes; ++i) {
    const auto u = static_cast<float>(random->Uniform(-0.75, 0.75)) * l;
    const auto v = static_cast<float>(random->Uniform(-0.7, 0.7)) * w;
    const auto size = static_cast<float>(random->Uniform(0.8, 2.6));
    const auto tone = static_cast<float>(random->Uniform(0.25, 0.7));
    mesh->AddBox({house.At(u, v, h - 0.5f), house.along, size, 0.7f * size, 0.4f + 0.5f * size},
                 {Finish::kMetalRoof, tone, 0}, {Finish::kMetalRoof, 0.9f * tone, 0});
  }
}

class Builder {
 public:
  Builder(const SceneOptions& options, const RoadNetwork& roads, const Water& water,
          const Terrain& terrain)
      : options_(options), roads_(roads), water_(water), terrain_(terrain) {}

  void Build(const Parcel& parcel) {
    Random random(parcel.seed);
    const bool large = options_.storeys > 3;
    const double wanted_length = std::min(parcel.length_m - 6, random.Uniform(9, large ? 28 : 15));
    const double wanted_width =
        std::min(parcel.breadth_m - 6, random.Uniform(7.5, large ? 15 : 10));
    const Vector2d across(-parcel.along.y(), parcel.along.x());
    const Vector2d centre =
        parcel.centre + random.Uniform(-1, 1) * parcel.along + random.Uniform(-1, 1) * across;
    // Streets take a part of some plots: smaller houses fit there.
    constexpr double kShrink = 0.85, kLeastLengthM = 6, kLeastWidthM = 5;
    Footprint main{centre, parcel.along, wanted_length / 2, wanted_width / 2};
    while (!IsFree(main)) {
      main.half_length_m *= kShrink;
      main.half_width_m *= kShrink;
      if (2 * main.half_length_m < kLeastLengthM || 2 * main.half_width_m < kLeastWidthM) return;
    }
    const double length = 2 * main.half_length_m, width = 2 * main.half_width_m;
    const int storeys = std::max(
        1,
        static_cast<int>(std::lround(options_.storeys + random.Gaussian(0.25 * options_.storeys))));
    AddHouse(main, storeys, &random);

    // A wing or a shed beside.
    if (random.Uniform(0, 1) < 0.6) {
      const double side = random.Index(2) == 0 ? -1 : 1;
      const double wing_length = random.Uniform(4, 6.5), wing_width = random.Uniform(3.5, 5.5);
      const bool attached = random.Index(2) == 0;
      const Vector2d at = centre +
                          side * (width / 2 + wing_width / 2 + (attached ? -0.3 : 2.5)) * across +
                          random.Uniform(-0.3, 0.3) * length * parcel.along;
      const Footprint wing{at, parcel.along, wing_length / 2, wing_width / 2};
      if (IsFree(wing)) AddHouse(wing, 1, &random);
    }
  }

  Buildings Take() { return std::move(buildings_); }

 private:
  std::vector<Vector2d> Outline(const Footprint& footprint) const {
    const Vector2d across(-footprint.along.y(), footprint.along.x());
    std::vector<Vector2d> points;
    for (const double u : {-1.0, 0.0, 1.0}) {
      for (const double v : {-1.0, 0.0, 1.0}) {
        points.push_back(footprint.centre + u * footprint.half_length_m * footprint.along +
                         v * footprint.half_width_m * across);
      }
    }
    return points;
  }

  bool IsFree(const Footprint& footprint) const {
    constexpr float kFromRoadM = 2, kFromShoreM = 8;
    for (const Vector2d& point : Outline(footprint)) {
      const auto x = static_cast<float>(point.x()), y = static_cast<float>(point.y());
      if (roads_.Find(x, y).edge_m < kFromRoadM || water_.ShoreDistance(x, y) < kFromShoreM)
        return false;
      if (std::max(std::abs(x), std::abs(y)) > options_.extent_m / 2 - 3) return false;
    }
    return true;
  }

  void AddHouse(const Footprint& footprint, int storeys, Random* random) {
    double lowest = 1e9, highest = -1e9;
    for (const Vector2d& point : Outline(footprint)) {
      const double height = terrain_.Height(point.x(), point.y());
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
    }
    House house;
    constexpr double kCellarM = 0.3;
    house.base = {static_cast<float>(footprint.centre.x()),
                  static_cast<float>(footprint.centre.y()), static_cast<float>(lowest - kCellarM)};
    house.along = {static_cast<float>(footprint.along.x()), static_cast<float>(footprint.along.y()),
                   0};
    house.across = {-house.along.y(), house.along.x(), 0};
    house.length = static_cast<float>(2 * footprint.half_length_m);
    house.width = static_cast<float>(2 * footprint.half_width_m);
    house.height =
        static_cast<float>(highest - lowest + kCellarM) + kStoreyM * static_cast<float>(storeys);
    static constexpr Finish kWalls[] = {Finish::kPlasterWall, Finish::kPlasterWall,
                                        Finish::kBrickWall, Finish::kConcreteWall};
    const auto seed = static_cast<uint32_t>(random->Index(1 << 30));
    house.walls = {kWalls[random->Index(options_.storeys > 3 ? 4 : 3)],
                   static_cast<float>(random->Uniform(0.28, 0.72)), seed};
    house.roof = {random->Uniform(0, 1) < 0.85 ? Finish::kTiledRoof : Finish::kMetalRoof,
                  static_cast<float>(random->Uniform(0.12, 0.34)), seed + 1};
    AddWalls(house, &buildings_.mesh);
    AddRoof(house, random);
    buildings_.footprints.push_back(footprint);
  }

  void AddRoof(const House& house, Random* random) {
    FaceMesh* mesh = &buildings_.mesh;
    if (random->Uniform(0, 1) < options_.flat_roof_fraction) {
      AddFlatRoof(house, random, mesh);
      return;
    }
    const auto rise = house.width / 2 * static_cast<float>(random->Uniform(0.55, 1.0));
    const float hip = random->Uniform(0, 1) < 0.3 ? house.width / 2 : 0;
    AddPitchedRoof(house, rise, hip, mesh);
    const auto u = static_cast<float>(random->Uniform(-0.3, 0.3)) * house.length;
    AddChimney(house, u, 0.12f * house.width, house.height + rise, mesh);
    if (house.length > 10 && random->Index(2) == 0) {
      for (const float at : {-0.28f, 0.28f}) {
        AddDormer(house, at * house.length, random->Index(2) == 0 ? -1.0f : 1.0f, rise, mesh);
      }
    }
  }

  const SceneOptions& options_;
  const RoadNetwork& roads_;
  const Water& water_;
  const Terrain& terrain_;
  Buildings buildings_;
};

}  // namespace

bool Footprint::Covers(const Vector2d& point, double margin_m) const {
  const Vector2d offset = point - centre;
  const double across = along.x() * offset.y() - along.y() * offset.x();
  return std::abs(along.dot(offset)) < half_length_m + margin_m &&
         std::abs(across) < half_width_m + margin_m;
}

Buildings PlaceBuildings(const SceneOptions& options, const ParcelMap& parcels,
                         const RoadNetwork& roads, const Water& water, const Terrain& terrain) {
  Builder builder(options, roads, water, terrain);
  for (const Parcel& parcel : parcels.parcels()) {
    if (parcel.kind == ParcelKind::kGarden) builder.Build(parcel);
  }
  return builder.Take();
}

}  // namespace deepuav
