#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "deepuav/simulation/testing/small_land.h"
#include "deepuav/simulation/world/ground_cover.h"
#include "deepuav/simulation/world/traffic.h"
#include "deepuav/simulation/world/vegetation.h"

namespace deepuav {
namespace {

TEST(ParcelMap, FindsTheParcelOfEveryCentre) {
  const Land land(SmallVillage());
  ASSERT_GT(land.parcels.parcels().size(), 40u);
  for (const Parcel& parcel : land.parcels.parcels()) {
    const auto place = land.parcels.Find(static_cast<float>(parcel.centre.x()),
                                         static_cast<float>(parcel.centre.y()));
    EXPECT_EQ(place.parcel, &parcel);
    EXPECT_GT(place.border_m, 2);
  }
}

TEST(RoadNetwork, TellsWhereOnTheRoadAPointIs) {
  const RoadSite site{{{-100, 0}, {0, 0}, {100, 0}}, RoadClass::kStreet};
  const RoadNetwork roads({site}, 150, [](const Eigen::Vector2d&) { return false; });
  const auto place = roads.Find(30, 1.5f);
  ASSERT_NE(place.road, nullptr);
  EXPECT_NEAR(place.across_m, 1.5f, 1e-4);
  EXPECT_NEAR(place.along_m, 130, 1e-3);
  EXPECT_NEAR(place.edge_m, 1.5f - place.road->half_width_m, 1e-4);
  EXPECT_LT(roads.Find(30, -1.5f).across_m, 0);
  EXPECT_EQ(roads.Find(30, 40).road, nullptr);
}

TEST(RoadNetwork, AgreesWithASearchOfAllSegments) {
  const Land land(SmallVillage());
  Random random(3);
  int found = 0;
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector2d point(random.Uniform(-245, 245), random.Uniform(-245, 245));
    double nearest = 1e9;
    for (const Road& road : land.roads.roads()) {
      for (size_t k = 1; k < road.points.size(); ++k) {
        const Eigen::Vector2d span = road.points[k] - road.points[k - 1];
        const double t =
            std::clamp((point - road.points[k - 1]).dot(span) / span.squaredNorm(), 0.0, 1.0);
        nearest =
            std::min(nearest, (point - road.points[k - 1] - t * span).norm() - road.half_width_m);
      }
    }
    const auto place =
        land.roads.Find(static_cast<float>(point.x()), static_cast<float>(point.y()));
    if (nearest < RoadNetwork::kVergeM - 0.01) {
      ASSERT_NE(place.road, nullptr);
      EXPECT_NEAR(place.edge_m, nearest, 1e-3);
      ++found;
    } else if (nearest > RoadNetwork::kVergeM + 0.01) {
      EXPECT_EQ(place.road, nullptr);
    }
  }
  EXPECT_GT(found, 100);
}

TEST(RoadNetwork, CutsWhereBlockedAndOutside) {
  const RoadSite site{{{-200, 0}, {-90, 0}, {-50, 0}, {0, 0}, {50, 0}, {90, 0}, {200, 0}},
                      RoadClass::kTrack};
  const RoadNetwork roads({site}, 100,
                          [](const Eigen::Vector2d& p) { return std::abs(p.x()) < 1; });
  ASSERT_EQ(roads.roads().size(), 2u);
  for (const Road& road : roads.roads()) EXPECT_NEAR(road.length_m(), 40, 1e-9);
}

TEST(Terrain, HeightLiesOnItsTriangles) {
  const Land land(SmallVillage());
  const Terrain::Mesh mesh = land.terrain.MakeMesh();
  int inside = 0;
  for (size_t i = 0; i < mesh.triangles.size(); i += 97) {
    const auto& triangle = mesh.triangles[i];
    const Eigen::Vector3f middle =
        (mesh.vertices[triangle[0]] + mesh.vertices[triangle[1]] + mesh.vertices[triangle[2]]) / 3;
    if (middle.head<2>().cwiseAbs().maxCoeff() > 249) continue;
    EXPECT_NEAR(middle.z(), land.terrain.Height(middle.x(), middle.y()), 1e-3);
    ++inside;
  }
  EXPECT_GT(inside, 100);
}

TEST(Terrain, IsUnderWaterInWaterAloneAndRoadsKeepDry) {
  const Land land(SmallVillage());
  int wet = 0, dry = 0;
  for (double y = -248; y < 248; y += 3) {
    for (double x = -248; x < 248; x += 3) {
      const float shore = land.water.ShoreDistance(static_cast<float>(x), static_cast<float>(y));
      const auto road = land.roads.Find(static_cast<float>(x), static_cast<float>(y));
      const double height = land.terrain.Height(x, y);
      if (shore < -10 && road.road == nullptr) {
        EXPECT_LT(height, 0);
        ++wet;
      } else if (shore > 8) {
        EXPECT_GT(height, 0);
        ++dry;
      }
    }
  }
  EXPECT_GT(wet, 50);
  EXPECT_GT(dry, 1000);
  for (const Road& road : land.roads.roads()) {
    for (const Eigen::Vector2d& point : road.points)
      EXPECT_GT(land.terrain.Height(point.x(), point.y()), 0.3);
  }
}

TEST(Terrain, MirrorsBeyondItsBorder) {
  const Land land(SmallVillage());
  EXPECT_EQ(land.terrain.Mirrored(10, -20), Eigen::Vector2f(10, -20));
  EXPECT_TRUE(land.terrain.Mirrored(260, 0).isApprox(Eigen::Vector2f(240, 0)));
  EXPECT_TRUE(land.terrain.Mirrored(-800, 0).isApprox(Eigen::Vector2f(200, 0)));
}

TEST(Terrain, ReadsHeightsOfAnImage) {
  const auto file = std::filesystem::temp_directory_path() / "deepuav_dem_test.png";
  cv::Mat1w dem(11, 11);
  for (int y = 0; y < 11; ++y) {
    for (int x = 0; x < 11; ++x) dem(y, x) = static_cast<uint16_t>(100 + 10 * x + 2 * y);
  }
  cv::imwrite(file.string(), dem);
  SceneOptions options = SmallVillage();
  options.extent_m = 100;
  options.terrain_cell_m = 5;
  options.dem = file.string();
  options.dem_cell_m = 10;
  options.dem_unit_m = 0.1;
  const Land land(options);
  // East is right and north is up: one cell is 10 m.
  EXPECT_NEAR(land.terrain.Height(20, 10) - land.terrain.Height(0, 10), 2, 1e-6);
  EXPECT_NEAR(land.terrain.Height(0, 20) - land.terrain.Height(0, 0), -0.4, 1e-6);
  std::filesystem::remove(file);
  EXPECT_THROW(Land{options}, Error);
}

TEST(Buildings, StandClearOfRoadsAndOfWater) {
  const Land land(SmallVillage());
  const Buildings buildings =
      PlaceBuildings(land.options, land.parcels, land.roads, land.water, land.terrain);
  ASSERT_GT(buildings.footprints.size(), 10u);
  for (const Footprint& footprint : buildings.footprints) {
    const auto x = static_cast<float>(footprint.centre.x()),
               y = static_cast<float>(footprint.centre.y());
    EXPECT_GT(land.roads.Find(x, y).edge_m, 4);
    EXPECT_GT(land.water.ShoreDistance(x, y), 5);
  }
  for (const auto& triangle : buildings.mesh.triangles) {
    EXPECT_LT(triangle.maxCoeff(), buildings.mesh.vertices.size());
  }
  EXPECT_EQ(buildings.mesh.face_of_triangle.size(), buildings.mesh.triangles.size());
}

TEST(Vegetation, GrowsOnLandOutsideHousesAndRoads) {
  const Land land(SmallVillage());
  const Buildings buildings =
      PlaceBuildings(land.options, land.parcels, land.roads, land.water, land.terrain);
  const auto plants = PlacePlants(land.options, land.parcels, land.roads, land.water, land.terrain,
                                  buildings.footprints);
  ASSERT_GT(plants.size(), 200u);
  const auto prototypes = MakePlantPrototypes(1);
  for (const Placed& plant : plants) {
    ASSERT_LT(static_cast<size_t>(plant.prototype), prototypes.size());
    const Eigen::Vector2d at = plant.position.head<2>().cast<double>();
    EXPECT_NEAR(plant.position.z(), land.terrain.Height(at.x(), at.y()), 1e-3);
    EXPECT_GT(land.roads.Find(plant.position.x(), plant.position.y()).edge_m, 0.3);
    for (const Footprint& footprint : buildings.footprints) EXPECT_FALSE(footprint.Covers(at, 0.3));
  }
}

TEST(Traffic, KeepsToItsLaneAndSpeed) {
  const Land land(SmallVillage());
  const Traffic traffic(land.options, land.roads, land.terrain);
  ASSERT_GT(traffic.movers().size(), 5u);
  for (const Traffic::Mover& mover : traffic.movers()) {
    constexpr double kFrom = 3, kTo = 3.1;
    if (traffic.Jumps(mover, kFrom, kTo)) continue;
    const Placement from = traffic.PlacementAt(mover, kFrom), to = traffic.PlacementAt(mover, kTo);
    const double moved = (to.col(3) - from.col(3)).norm();
    EXPECT_NEAR(moved / (kTo - kFrom), std::abs(mover.speed_m_s), 0.25 * std::abs(mover.speed_m_s));
    EXPECT_TRUE((from.leftCols<3>().transpose() * from.leftCols<3>()).isIdentity(1e-4));
    const auto place = land.roads.Find(from(0, 3), from(1, 3));
    ASSERT_NE(place.road, nullptr);
    EXPECT_GT(from(2, 2), 0.8);
  }
}

TEST(Traffic, SlowsDownStandsAndDrivesOn) {
  SceneOptions options = SmallVillage();
  const Land land(options);
  const Traffic flowing(options, land.roads, land.terrain);
  options.traffic_stop_s = 10;
  options.traffic_stands_s = 5;
  const Traffic stopping(options, land.roads, land.terrain);
  const auto moved = [&](const Traffic& traffic, size_t mover, double from_s, double to_s) {
    const auto position = [&](double time_s) -> Eigen::Vector3f {
      return traffic.PlacementAt(traffic.movers()[mover], time_s).col(3);
    };
    return static_cast<double>((position(to_s) - position(from_s)).norm());
  };
  ASSERT_EQ(flowing.movers().size(), stopping.movers().size());
  int compared = 0;
  for (size_t i = 0; i < flowing.movers().size(); ++i) {
    EXPECT_LT(moved(stopping, i, 10, 15), 1e-4);
    const Traffic::Mover& mover = stopping.movers()[i];
    if (stopping.Jumps(mover, 0, 30) || flowing.Jumps(mover, 0, 30)) continue;
    ++compared;
    EXPECT_LT((stopping.PlacementAt(mover, 6) - flowing.PlacementAt(mover, 6)).norm(), 1e-4);
    // Eight seconds are lost: five of standing, three by braking and starting.
    EXPECT_LT((stopping.PlacementAt(mover, 30) - flowing.PlacementAt(mover, 22)).norm(), 1e-3);
  }
  EXPECT_GT(compared, 3);
}

TEST(Traffic, LorriesTakeThePlaceOfCars) {
  SceneOptions options = SmallVillage();
  const Land land(options);
  const Traffic cars(options, land.roads, land.terrain);
  options.lorry_fraction = 1;
  options.people_per_km = 0;
  const Traffic lorries(options, land.roads, land.terrain);
  ASSERT_GT(lorries.movers().size(), 2u);
  std::set<int> kinds;
  for (const Traffic::Mover& mover : lorries.movers()) kinds.insert(mover.prototype);
  EXPECT_EQ(kinds.size(), 1u);
  EXPECT_GT(std::count_if(cars.movers().begin(), cars.movers().end(),
                          [&](const Traffic::Mover& m) { return !kinds.contains(m.prototype); }),
            2);
}

TEST(Traffic, OnOneLaneDoesNotCollide) {
  const Land land(SmallVillage());
  const Traffic traffic(land.options, land.roads, land.terrain);
  const auto& movers = traffic.movers();
  for (size_t i = 0; i < movers.size(); ++i) {
    for (size_t j = i + 1; j < movers.size(); ++j) {
      if (movers[i].road != movers[j].road || movers[i].lane_m != movers[j].lane_m) continue;
      EXPECT_EQ(movers[i].speed_m_s, movers[j].speed_m_s);
      EXPECT_GE(std::abs(movers[i].start_m - movers[j].start_m), 3 - 1e-9);
    }
  }
}

TEST(GroundCover, IsAPossibleAlbedoEverywhereAtEveryFootprint) {
  const Land land(SmallVillage());
  const MaterialTextures textures(1);
  const GroundCover cover(land.options, textures, land.parcels, land.roads);
  for (const float footprint : {0.005f, 0.1f, 1.0f, 10.0f}) {
    for (float y = -248; y < 248; y += 7.3f) {
      for (float x = -248; x < 248; x += 7.1f) {
        const float albedo = cover.Albedo(x, y, 5, footprint);
        ASSERT_GT(albedo, -0.1f) << x << " " << y;
        ASSERT_LT(albedo, 1.1f) << x << " " << y;
      }
    }
  }
}

TEST(Scene, IsReadFromAFileOverANamedOne) {
  const auto file = std::filesystem::temp_directory_path() / "deepuav_scene_test.yaml";
  std::ofstream(file) << "base: desert\nextent_m: 600\nseed: 9\ndem: heights.png\n";
  const SceneOptions scene = LoadScene(file.string());
  EXPECT_EQ(scene.seed, 9);
  EXPECT_EQ(scene.extent_m, 600);
  EXPECT_EQ(scene.aridity, 1);
  EXPECT_EQ(scene.dem, (file.parent_path() / "heights.png").string());
  const auto message = [&](const char* text) -> std::string {
    std::ofstream(file) << text;
    try {
      LoadScene(file.string());
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message("relif_m: 3\n").find("relief_m"), std::string::npos);
  EXPECT_NE(message("aridity: 3\n").find("0 to 1"), std::string::npos);
  EXPECT_NE(message("extent_m: [1, 2]\n").find("extent_m"), std::string::npos);
  EXPECT_NE(message("base: dessert\n").find("desert"), std::string::npos);
  EXPECT_NE(message("a: [b\n").find("YAML"), std::string::npos);
  std::filesystem::remove(file);
}

TEST(Scene, EveryNameLoads) {
  for (const std::string& name : SceneNames()) EXPECT_NO_THROW(LoadScene(name)) << name;
  EXPECT_THROW(LoadScene("vilage"), Error);
}

}  // namespace
}  // namespace deepuav
