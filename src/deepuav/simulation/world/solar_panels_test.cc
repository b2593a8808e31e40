#include "deepuav/simulation/world/solar_panels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "deepuav/simulation/testing/small_land.h"
#include "deepuav/simulation/world/surface.h"

namespace deepuav {
namespace {

SolarPanels Placed(const Land& land, const std::vector<Footprint>& built = {}) {
  return PlaceSolarPanels(land.options, land.roads, land.water, land.terrain, built);
}

TEST(SolarPanels, AreNoneUnlessAskedFor) {
  const SolarPanels none = Placed(Land(FlatLand()));
  EXPECT_TRUE(none.footprints.empty());
  EXPECT_TRUE(none.mesh.faces.empty());
}

TEST(SolarPanels, StandInRowsThatLeanTowardsTheSouth) {
  SceneOptions options = FlatLand();
  options.solar_panels_m = 100;
  const SolarPanels panels = Placed(Land(options));
  ASSERT_GT(panels.footprints.size(), 15);
  ASSERT_EQ(panels.mesh.faces.size(), panels.footprints.size());
  for (size_t i = 0; i < panels.mesh.faces.size(); ++i) {
    const Face& face = panels.mesh.faces[i];
    EXPECT_EQ(face.finish, Finish::kSolarPanels);
    EXPECT_NEAR(face.width_m, 20, 1e-3);
    EXPECT_NEAR(face.height_m, 4, 1e-3);
    EXPECT_NEAR(face.u_axis.x(), 1, 1e-4);
    EXPECT_GT(face.v_axis.y(), 0.9);  // Its upper edge is the northern one.
    EXPECT_NEAR(face.v_axis.z(), 0.342, 1e-3);
    EXPECT_NEAR(face.origin.z(), kFlatLandHeightM + 0.8, 1e-3);
    EXPECT_TRUE(panels.footprints[i].Covers({face.origin.x(), face.origin.y()}, 0.01));
    EXPECT_LE(panels.footprints[i].centre.cwiseAbs().maxCoeff(), 50);
  }
}

TEST(SolarPanels, LeaveRoadsWaterAndHousesFree) {
  SceneOptions options = SmallVillage();
  options.solar_panels_m = 2000;
  const Land land(options);
  const Buildings houses =
      PlaceBuildings(land.options, land.parcels, land.roads, land.water, land.terrain);
  const SolarPanels panels = Placed(land, houses.footprints);
  ASSERT_GT(panels.footprints.size(), 100);
  for (const Footprint& table : panels.footprints) {
    for (const double u : {-1.0, 0.0, 1.0}) {
      const auto x = static_cast<float>(table.centre.x() + u * table.half_length_m);
      for (const double v : {-1.0, 1.0}) {
        const auto y = static_cast<float>(table.centre.y() + v * table.half_width_m);
        EXPECT_GT(land.roads.Find(x, y).edge_m, 2);
        EXPECT_GT(land.water.ShoreDistance(x, y), 4);
        EXPECT_LT(std::max(std::abs(x), std::abs(y)), options.extent_m / 2);
        for (const Footprint& house : houses.footprints) EXPECT_FALSE(house.Covers({x, y}, 0));
      }
    }
  }
}

TEST(SolarPanels, LookAlikeButForToneAndDust) {
  const MaterialTextures textures(3);
  Face face;
  face.width_m = 20;
  face.height_m = 4;
  face.finish = Finish::kSolarPanels;
  face.tone = 0.05F;
  const auto albedo = [&](float u, float v) {
    return FaceAppearance(textures, face, {u, v, 0}, Eigen::Vector3f::UnitZ(), 0, 0.002F).albedo;
  };
  for (float panel = 0; panel < 19; ++panel) {
    EXPECT_LT(albedo(panel + 0.58F, 1.08F), 0.1F);   // Inside of a cell...
    EXPECT_GT(albedo(panel + 1.025F, 1.08F), 0.3F);  // ...and on the frame beside.
  }
  // The same dust lies beside one another.
  float largest = 0;
  for (float panel = 0; panel < 19; ++panel) {
    const float here = albedo(panel + 0.92F, 1.08F), beside = albedo(panel + 1.12F, 1.08F);
    largest = std::max(largest, std::abs(here - beside) / here);
  }
  EXPECT_GT(largest, 0.1);
}

}  // namespace
}  // namespace deepuav
