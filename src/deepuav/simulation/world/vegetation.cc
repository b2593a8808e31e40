#include "deepuav/simulation/world/vegetation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "deepuav/base/random.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;

// The prototypes' order in MakePlantPrototypes.
constexpr int kBroadleaf = 0, kBroadleafKinds = 4;
constexpr int kConifer = kBroadleaf + kBroadleafKinds, kConiferKinds = 2;
constexpr int kBush = kConifer + kConiferKinds, kBushKinds = 3;
constexpr int kRock = kBush + kBushKinds, kRockKinds = 3;
constexpr int kBale = kRock + kRockKinds;
constexpr int kPole = kBale + 1;

constexpr double kTwoPi = 2 * std::numbers::pi;

float Within(double low, double high, Random* random) {
  return static_cast<float>(random->Uniform(low, high));
}

void AddTrunk(float height, float thickness, FaceMesh* mesh) {
  mesh->AddBox({{0, 0, -0.5f}, Vector3f::UnitX(), thickness, thickness, height + 0.5f},
               {Finish::kBark, 0.13f, 1}, {Finish::kBark, 0.13f, 2});
}

FaceMesh MakeBroadleaf(uint32_t seed) {
  Random random(seed);
  FaceMesh mesh;
  AddTrunk(4, 0.4f, &mesh);
  mesh.AddBall({{0, 0, 5.6f}, {1.9f, 1.9f, 1.7f}, 2, 0.3f}, {Finish::kLeaves, 0.09f, seed + 1});
  // Clumps of leaves all over the crown, by the golden angle.
  const int clumps = 30 + random.Index(10);
  for (int i = 0; i < clumps; ++i) {
    const double angle = kTwoPi * 0.381966 * i + random.Uniform(-0.4, 0.4);
    const double up = 1 - 1.8 * (i + 0.5) / clumps;
    const double level = std::sqrt(1 - up * up), reach = random.Uniform(1.7, 2.5);
    const float size = Within(0.6, 1.15, &random);
    const Vector3f centre(static_cast<float>(reach * level * std::cos(angle)),
                          static_cast<float>(reach * level * std::sin(angle)),
                          static_cast<float>(5.6 + 0.95 * reach * up));
    mesh.AddBall(
        {centre, {size, size, 0.8f * size}, 1, 0.3f},
        {Finish::kLeaves, Within(0.11, 0.21, &random), seed + static_cast<uint32_t>(7 * i)});
  }
  return mesh;
}

// Tiers of drooping branches: cones whose rims go in and out.
FaceMesh MakeConifer(uint32_t seed) {
  Random random(seed);
  FaceMesh mesh;
  AddTrunk(3, 0.35f, &mesh);
  constexpr int kTiers = 7, kSides = 15;
  for (int tier = 0; tier < kTiers; ++tier) {
    const float down = 1 - static_cast<float>(tier) / kTiers;
    const float base = 1.4f + 9.5f * (1 - down), radius = 0.35f + 2.1f * down;
    const Vector3f top(0, 0, base + 2.4f);
    const FaceMesh::Look look{Finish::kLeaves, Within(0.07, 0.11, &random),
                              seed + static_cast<uint32_t>(tier)};
    std::vector<Vector3f> rim;
    for (int side = 0; side < kSides; ++side) {
      const double angle = kTwoPi * (side + 0.37 * tier) / kSides;
      const double reach = radius * (side % 2 == 0 ? 1 : 0.62) * random.Uniform(0.85, 1.15);
      rim.emplace_back(static_cast<float>(reach * std::cos(angle)),
                       static_cast<float>(reach * std::sin(angle)), base - Within(0, 0.5, &random));
    }
    for (size_t side = 0; side < rim.size(); ++side) {
      mesh.AddTriangle(rim[side], rim[(side + 1) % rim.size()], top, look);
    }
  }
  return mesh;
}

FaceMesh MakeBush(uint32_t seed) {
  Random random(seed);
  FaceMesh mesh;
  const int blobs = 2 + random.Index(3);
  for (int i = 0; i < blobs; ++i) {
    const float size = Within(0.6, 1.0, &random);
    const Vector3f centre(Within(-0.7, 0.7, &random), Within(-0.7, 0.7, &random), 0.6f * size);
    mesh.AddBall({centre, {size, size, size}, 2, 0.35f},
                 {Finish::kLeaves, Within(0.1, 0.2, &random), seed + static_cast<uint32_t>(7 * i)});
  }
  return mesh;
}

FaceMesh MakeRock(uint32_t seed) {
  Random random(seed);
  FaceMesh mesh;
  mesh.AddBall(
      {{0, 0, 0.15f}, {Within(0.6, 1, &random), Within(0.5, 0.8, &random), 0.5f}, 2, 0.45f},
      {Finish::kRock, Within(0.25, 0.5, &random), seed});
  return mesh;
}

FaceMesh MakeBale() {
  FaceMesh mesh;
  constexpr int kSides = 16;
  constexpr float kRadius = 0.75f, kHalfWidth = 0.62f;
  const FaceMesh::Look look{Finish::kStraw, 0.42f, 3};
  const auto rim = [&](int i, float x) {
    const double angle = kTwoPi * i / kSides;
    return Vector3f(x, kRadius * static_cast<float>(std::cos(angle)),
                    kRadius * (1 + static_cast<float>(std::sin(angle))));
  };
  for (int i = 0; i < kSides; ++i) {
    mesh.AddQuad(rim(i, -kHalfWidth), rim(i + 1, -kHalfWidth), rim(i + 1, kHalfWidth),
                 rim(i, kHalfWidth), look);
    for (const float x : {-kHalfWidth, kHalfWidth}) {
      mesh.AddTriangle(rim(i, x), rim(i + 1, x), {x, 0, kRadius}, look);
    }
  }
  return mesh;
}

FaceMesh MakePole() {
  FaceMesh mesh;
  mesh.AddBox({{0, 0, -0.5f}, Vector3f::UnitX(), 0.16f, 0.16f, 6.5f}, {Finish::kPaint, 0.3f, 0},
              {Finish::kPaint, 0.3f, 0});
  mesh.AddBox({{0.7f, 0, 5.9f}, Vector3f::UnitX(), 1.5f, 0.2f, 0.12f}, {Finish::kPaint, 0.4f, 0},
              {Finish::kPaint, 0.5f, 0});
  return mesh;
}

class Planter {
 public:
  Planter(const SceneOptions& options, const ParcelMap& parcels, const RoadNetwork& roads,
          const Water& water, const Terrain& terrain, const std::vector<Footprint>& footprints)
      : options_(options),
        parcels_(parcels),
        roads_(roads),
        water_(water),
        terrain_(terrain),
        footprints_(footprints),
        random_(HashCell(options.seed, 5, 0x7e7ab1u)) {}

  std::vector<Placed> Plant() {
    for (const Parcel& parcel : parcels_.parcels()) {
      PlantParcel(parcel);
      if (!parcel.in_town) PlantHedge(parcel);
    }
    for (const Road& road : roads_.roads()) PlantRoadside(road);
    return std::move(placed_);
  }

 private:
  // True with the given chance, at sites of single trees.
  bool Chance(double chance) { return random_.Uniform(0, 1) < chance; }

  void Place(int first, int kinds, const Vector2d& at, double scale, float room_m) {
    const auto x = static_cast<float>(at.x()), y = static_cast<float>(at.y());
    const int prototype = first + random_.Index(kinds);
    const float heading = Within(0, kTwoPi, &random_);
    if (at.cwiseAbs().maxCoeff() > options_.extent_m / 2 - 2) return;
    if (roads_.Find(x, y).edge_m < room_m || water_.ShoreDistance(x, y) < 1.5f) return;
    for (const Footprint& footprint : footprints_) {
      if (footprint.Covers(at, room_m)) return;
    }
    const auto z = static_cast<float>(terrain_.Height(at.x(), at.y()));
    placed_.push_back({prototype, {x, y, z}, heading, static_cast<float>(scale)});
  }

  // Calls `visit` at the points of a grid along the parcel's rows, moved by chance by up to
  // `jitter` of a step, that lie in the parcel.
  template <typename Visit>
  void ForEachInParcel(const Parcel& parcel, double step, double jitter, const Visit& visit) {
    const Vector2d across(-parcel.along.y(), parcel.along.x());
    const double reach = 0.75 * std::hypot(parcel.length_m, parcel.breadth_m);
    for (double u = -reach; u < reach; u += step) {
      for (double v = -reach; v < reach; v += step) {
        const double du = jitter * step * random_.Uniform(-0.5, 0.5);
        const double dv = jitter * step * random_.Uniform(-0.5, 0.5);
        const Vector2d at = parcel.centre + (u + du) * parcel.along + (v + dv) * across;
        const auto place = parcels_.Find(static_cast<float>(at.x()), static_cast<float>(at.y()));
        if (place.parcel == &parcel && place.border_m > 1.5f) visit(at);
      }
    }
  }

  void PlantParcel(const Parcel& parcel) {
    switch (parcel.kind) {
      case ParcelKind::kForest: {
        const bool conifers = parcel.seed % 3 == 0;
        ForEachInParcel(parcel, 5.6, 0.9, [&](const Vector2d& at) {
          const bool conifer = random_.Uniform(0, 1) < (conifers ? 0.85 : 0.12);
          const double scale = random_.Uniform(0.8, 1.6);
          if (conifer) return Place(kConifer, kConiferKinds, at, scale, 2);
          return Place(kBroadleaf, kBroadleafKinds, at, scale, 2);
        });
        return;
      }
      case ParcelKind::kOrchard:
        ForEachInParcel(parcel, 6, 0.12, [&](const Vector2d& at) {
          Place(kBroadleaf, kBroadleafKinds, at, random_.Uniform(0.36, 0.5), 1);
        });
        return;
      case ParcelKind::kGarden:
      case ParcelKind::kSquare:
        ForEachInParcel(parcel, 6.5, 1, [&](const Vector2d& at) {
          if (!Chance(options_.tree_fraction)) return;
          if (random_.Index(3) == 0) {
            Place(kBroadleaf, kBroadleafKinds, at, random_.Uniform(0.45, 1), 2.2f);
          } else {
            Place(kBush, kBushKinds, at, random_.Uniform(0.5, 1.3), 1);
          }
        });
        return;
      case ParcelKind::kMeadow:
        ForEachInParcel(parcel, 26, 1, [&](const Vector2d& at) {
          if (Chance(0.5 * options_.tree_fraction))
            Place(kBroadleaf, kBroadleafKinds, at, random_.Uniform(0.6, 1.4), 2);
        });
        return;
      case ParcelKind::kStubble:
        ForEachInParcel(parcel, 19, 0.6, [&](const Vector2d& at) {
          if (parcel.seed % 2 == 0 && Chance(0.7)) Place(kBale, 1, at, 1, 1);
        });
        return;
      case ParcelKind::kSand:
      case ParcelKind::kScrub:
        ForEachInParcel(parcel, 9, 1, [&](const Vector2d& at) {
          const double chance = random_.Uniform(0, 1);
          if (chance < 0.3) Place(kRock, kRockKinds, at, std::exp(random_.Gaussian(0.6)), 0.5f);
          if (chance > 0.45 && parcel.kind == ParcelKind::kScrub)
            Place(kBush, kBushKinds, at, random_.Uniform(0.3, 0.9), 0.5f);
        });
        return;
      case ParcelKind::kCrop:
      case ParcelKind::kWheat:
      case ParcelKind::kPloughed:
      case ParcelKind::kPlain:
        return;
    }
  }

  void PlantHedge(const Parcel& parcel) {
    if (options_.aridity > 0.5) return;
    for (size_t i = 0; i < parcel.corners.size(); ++i) {
      if (HashCell(static_cast<int>(i), 0, parcel.seed) % 4 != 0) continue;
      const Vector2d from = parcel.corners[i];
      const Vector2d span = parcel.corners[(i + 1) % parcel.corners.size()] - from;
      const double length = span.norm();
      for (double at = 1; at < length; at += 1.9) {
        const Vector2d point =
            from + at / length * span + Vector2d(random_.Gaussian(0.3), random_.Gaussian(0.3));
        if (random_.Uniform(0, 1) < 0.12) continue;
        if (random_.Uniform(0, 1) < 0.2 * options_.tree_fraction) {
          Place(kBroadleaf, kBroadleafKinds, point, random_.Uniform(0.5, 1.1), 2);
        } else {
          Place(kBush, kBushKinds, point, random_.Uniform(0.8, 1.3), 0.8f);
        }
      }
    }
  }

  void PlantRoadside(const Road& road) {
    if (road.road_class == RoadClass::kTrack) return;
    const bool street = road.road_class == RoadClass::kStreet;
    const double step = street ? 28 : 14;
    for (size_t i = 1; i < road.points.size(); ++i) {
      const double position = road.arc_m[i];
      if (std::floor(position / step) == std::floor(road.arc_m[i - 1] / step)) continue;
      const Vector2d direction = (road.points[i] - road.points[i - 1]).normalized();
      const Vector2d left(-direction.y(), direction.x());
      for (const double side : {-1.0, 1.0}) {
        const Vector2d at = road.points[i] + side * (road.half_width_m + 1.2) * left;
        if (street && side > 0) Place(kPole, 1, at, 1, 0.7f);
        const Vector2d outer = road.points[i] + side * (road.half_width_m + 3.4) * left;
        if (Chance(options_.tree_fraction))
          Place(kBroadleaf, kBroadleafKinds, outer, random_.Uniform(0.6, 1), 2.4f);
      }
    }
  }

  const SceneOptions& options_;
  const ParcelMap& parcels_;
  const RoadNetwork& roads_;
  const Water& water_;
  const Terrain& terrain_;
  const std::vector<Footprint>& footprints_;
  Random random_;
  std::vector<Placed> placed_;
};

}  // namespace

std::vector<FaceMesh> MakePlantPrototypes(uint32_t seed) {
  std::vector<FaceMesh> prototypes;
  for (uint32_t i = 0; i < kBroadleafKinds; ++i)
    prototypes.push_back(MakeBroadleaf(seed + 100 * i));
  for (uint32_t i = 0; i < kConiferKinds; ++i) prototypes.push_back(MakeConifer(seed + 1000 + i));
  for (uint32_t i = 0; i < kBushKinds; ++i) prototypes.push_back(MakeBush(seed + 2000 + 100 * i));
  for (uint32_t i = 0; i < kRockKinds; ++i) prototypes.push_back(MakeRock(seed + 3000 + i));
  prototypes.push_back(MakeBale());
  prototypes.push_back(MakePole());
  return prototypes;
}

std::vector<Placed> PlacePlants(const SceneOptions& options, const ParcelMap& parcels,
                                const RoadNetwork& roads, const Water& water,
                                const Terrain& terrain, const std::vector<Footprint>& footprints) {
  return Planter(options, parcels, roads, water, terrain, footprints).Plant();
}

}  // namespace deepuav
