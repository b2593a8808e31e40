#include "deepuav/simulation/world/buildings.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "deepuav/simulation/testing/small_land.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

struct Town {
  explicit Town(const SceneOptions& options)
      : land(options),
        buildings(
            PlaceBuildings(land.options, land.parcels, land.roads, land.water, land.terrain)) {}
  Land land;
  Buildings buildings;
};

SceneOptions TownOptions(int seed) {
  SceneOptions options = SmallVillage();
  options.seed = seed;
  options.town_radius_m = 130;
  return options;
}

Vector2d Across(const Footprint& f) { return {-f.along.y(), f.along.x()}; }

/// How deep one rectangle lies in another: the least overlap along the four axes of their sides,
/// m; negative where an axis parts them.
double Overlap(const Footprint& a, const Footprint& b) {
  double least = 1e9;
  for (const Vector2d& axis : {a.along, Across(a), b.along, Across(b)}) {
    const auto reach = [&](const Footprint& f) {
      return f.half_length_m * std::abs(f.along.dot(axis)) +
             f.half_width_m * std::abs(Across(f).dot(axis));
    };
    least = std::min(least, reach(a) + reach(b) - std::abs((a.centre - b.centre).dot(axis)));
  }
  return least;
}

TEST(Footprint, CoversItsRectangleAndItsMargin) {
  const Footprint f{{10, 20}, Vector2d(1, 1).normalized(), 6, 3};
  const auto at = [&](double u, double v) -> Vector2d {
    return f.centre + u * f.along + v * Across(f);
  };
  EXPECT_TRUE(f.Covers(at(5.9, -2.9), 0));
  EXPECT_FALSE(f.Covers(at(6.1, 0), 0));
  EXPECT_FALSE(f.Covers(at(0, 3.1), 0));
  EXPECT_TRUE(f.Covers(at(-6.9, 3.9), 1));
  EXPECT_FALSE(f.Covers(at(5.9, 0), -0.2));
}

TEST(BuildingsOfATown, HaveSensibleSizes) {
  for (const int seed : {1, 2, 3, 4}) {
    const Town town(TownOptions(seed));
    ASSERT_GT(town.buildings.footprints.size(), 15u);
    for (const Footprint& f : town.buildings.footprints) {
      EXPECT_GT(2 * f.half_length_m, 3.4);
      EXPECT_GT(2 * f.half_width_m, 3.4);
      EXPECT_LT(2 * f.half_length_m, 28.1);
      EXPECT_NEAR(f.along.norm(), 1, 1e-9);
    }
  }
}

TEST(BuildingsOfATown, StandOnNoRoadAndNotInTheWater) {
  for (const int seed : {1, 2, 3, 4}) {
    const Town town(TownOptions(seed));
    for (const Footprint& f : town.buildings.footprints) {
      for (double u = -1; u <= 1; u += 0.25) {
        for (double v = -1; v <= 1; v += 0.25) {
          const Vector2d at =
              f.centre + u * f.half_length_m * f.along + v * f.half_width_m * Across(f);
          const auto x = static_cast<float>(at.x()), y = static_cast<float>(at.y());
          EXPECT_GT(town.land.roads.Find(x, y).edge_m, 1) << seed << ": " << at.transpose();
          EXPECT_GT(town.land.water.ShoreDistance(x, y), 4);
        }
      }
    }
  }
}

// Wings reach 0.3 m into their houses. Beyond that a house of the next plot may stand in one, where
// a plot comes to a point: one pair in a hundred houses.
TEST(BuildingsOfATown, HardlyEverStandInOneAnother) {
  size_t houses = 0, pairs = 0;
  for (const int seed : {1, 2, 3, 4}) {
    const Town town(TownOptions(seed));
    const auto& footprints = town.buildings.footprints;
    houses += footprints.size();
    for (size_t i = 0; i < footprints.size(); ++i) {
      for (size_t j = i + 1; j < footprints.size(); ++j)
        pairs += Overlap(footprints[i], footprints[j]) > 0.31 ? 1 : 0;
    }
  }
  EXPECT_GT(houses, 200u);
  EXPECT_LE(100 * pairs, houses) << pairs << " pairs of " << houses;
}

/// How many triangles a ray meets.
int Crossings(const FaceMesh& mesh, const Vector3f& origin, const Vector3f& direction) {
  int crossings = 0;
  for (const auto& t : mesh.triangles) {
    const Vector3f a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin,
                   c = mesh.vertices[t[2]] - origin;
    const float ab = direction.dot(a.cross(b)), bc = direction.dot(b.cross(c)),
                ca = direction.dot(c.cross(a));
    const bool through = (ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0);
    const Vector3f normal = (b - a).cross(c - a);
    if (through && normal.dot(a) / normal.dot(direction) > 0) ++crossings;
  }
  return crossings;
}

TEST(BuildingsOfATown, AreClosedAllRoundAndAbove) {
  const Town town(TownOptions(1));
  size_t looked_at = 0;
  for (const Footprint& f : town.buildings.footprints) {
    if (++looked_at > 12) break;
    const double ground = town.land.terrain.Height(f.centre.x(), f.centre.y());
    const Vector3f inside(static_cast<float>(f.centre.x()), static_cast<float>(f.centre.y()),
                          static_cast<float>(ground + 1.4));
    for (int i = 0; i < 24; ++i) {
      const float angle = 0.13f + 0.2618f * static_cast<float>(i);
      EXPECT_GT(Crossings(town.buildings.mesh, inside, {std::cos(angle), std::sin(angle), 0.02f}),
                0);
    }
    for (double u = -0.9; u <= 0.9; u += 0.3) {
      const Vector2d at = f.centre + u * f.half_length_m * f.along + 0.37 * u * Across(f);
      EXPECT_GT(Crossings(town.buildings.mesh,
                          {static_cast<float>(at.x()), static_cast<float>(at.y()), inside.z()},
                          {0.001f, 0.002f, 1}),
                0);
    }
  }
  EXPECT_GT(looked_at, 10u);
}

TEST(BuildingsOfATown, BeginBelowTheGroundAllRound) {
  SceneOptions options = TownOptions(2);
  options.relief_m = 150;
  const Town town(options);
  for (const Footprint& f : town.buildings.footprints) {
    float lowest = 1e9f;
    for (const Vector3f& vertex : town.buildings.mesh.vertices) {
      if (f.Covers(vertex.head<2>().cast<double>(), 0.01)) lowest = std::min(lowest, vertex.z());
    }
    for (const double u : {-1.0, 1.0}) {
      for (const double v : {-1.0, 1.0}) {
        const Vector2d corner =
            f.centre + u * f.half_length_m * f.along + v * f.half_width_m * Across(f);
        EXPECT_LT(lowest, town.land.terrain.Height(corner.x(), corner.y()));
      }
    }
  }
}

TEST(BuildingsOfATown, AreNoneWhereNoneWereAsked) {
  SceneOptions options = TownOptions(1);
  options.building_fraction = 0;
  EXPECT_TRUE(Town(options).buildings.footprints.empty());
  options = TownOptions(1);
  options.town_radius_m = 0;
  EXPECT_TRUE(Town(options).buildings.mesh.triangles.empty());
}

}  // namespace
}  // namespace deepuav
