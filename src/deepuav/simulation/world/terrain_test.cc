#include "deepuav/simulation/world/terrain.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "deepuav/simulation/testing/small_land.h"

namespace deepuav {
namespace {

using Eigen::Vector3d;

/// The steepest slope over steps of `step_m` along lines to east and north.
double SteepestSlope(const Terrain& terrain, double step_m) {
  double steepest = 0;
  const double half = terrain.half_extent_m();
  for (double across = -half + 1; across < half; across += 17) {
    for (double along = -half; along + step_m <= half; along += step_m) {
      for (const auto& [a, b] :
           {std::pair(terrain.Height(along, across), terrain.Height(along + step_m, across)),
            std::pair(terrain.Height(across, along), terrain.Height(across, along + step_m))})
        steepest = std::max(steepest, std::abs(b - a) / step_m);
    }
  }
  return steepest;
}

TEST(TerrainSlopes, DoNotGrowInSmallSteps) {
  // A jump of height would be as steep as the step is short.
  const Land land(SmallVillage());
  const double coarse = SteepestSlope(land.terrain, 1), fine = SteepestSlope(land.terrain, 0.02);
  EXPECT_LT(fine, 1.3 * coarse);
  EXPECT_LT(fine, 2);
}

TEST(TerrainSlopes, GrowWithTheRelief) {
  SceneOptions options = SmallVillage();
  options.river_width_m = options.lake_radius_m = options.town_radius_m = 0;
  const auto spread = [&](double relief_m) {
    options.relief_m = relief_m;
    const Land land(options);
    double low = 1e9, high = -1e9;
    for (double y = -245; y < 245; y += 7) {
      for (double x = -245; x < 245; x += 7) {
        low = std::min(low, land.terrain.Height(x, y));
        high = std::max(high, land.terrain.Height(x, y));
      }
    }
    return high - low;
  };
  EXPECT_NEAR(spread(0), 0, 1e-9);
  const double hills = spread(20);
  EXPECT_GT(hills, 5);
  EXPECT_GT(spread(40), 1.5 * hills);
}

TEST(TerrainNormals, AreThoseOfTheHeights) {
  const Land land(SmallVillage());
  // A smooth normal is that of the mean slope over two cells.
  const double reach = 2 * land.options.terrain_cell_m;
  double worst_rad = 0, mean_rad = 0;
  int count = 0;
  for (double y = -230; y < 230; y += 9.1, ++count) {
    const double x = 230 * std::sin(0.13 * y);
    const auto height = [&](double dx, double dy) { return land.terrain.Height(x + dx, y + dy); };
    const Vector3d expected = Vector3d(height(-reach, 0) - height(reach, 0),
                                       height(0, -reach) - height(0, reach), 2 * reach)
                                  .normalized();
    const Vector3d normal =
        land.terrain.Normal(static_cast<float>(x), static_cast<float>(y)).cast<double>();
    EXPECT_NEAR(normal.norm(), 1, 1e-5);
    const double error_rad = std::acos(std::min(1.0, normal.dot(expected)));
    worst_rad = std::max(worst_rad, error_rad);
    mean_rad += error_rad;
  }
  EXPECT_LT(worst_rad, 0.3);
  EXPECT_LT(mean_rad / count, 0.05);
}

TEST(TerrainOutside, GoesOnFromTheBorder) {
  const Land land(SmallVillage());
  const double half = land.terrain.half_extent_m();
  for (double along = -240; along < 240; along += 23) {
    EXPECT_EQ(land.terrain.Height(half + 70, along), land.terrain.Height(half, along));
    EXPECT_EQ(land.terrain.Height(along, -half - 3), land.terrain.Height(along, -half));
  }
  // The mirror has no step at the border, and leads inside from anywhere.
  Random random(2);
  for (int i = 0; i < 500; ++i) {
    const auto x = static_cast<float>(random.Uniform(-6000, 6000)),
               y = static_cast<float>(random.Uniform(-6000, 6000));
    const Eigen::Vector2f inside = land.terrain.Mirrored(x, y);
    ASSERT_LE(inside.cwiseAbs().maxCoeff(), static_cast<float>(half) + 1e-3f) << x << " " << y;
    const Eigen::Vector2f beside = land.terrain.Mirrored(x + 0.5f, y);
    ASSERT_NEAR((beside - inside).norm(), 0.5, 0.51);
  }
}

TEST(TerrainMesh, HasNoHolesAndFacesUp) {
  SceneOptions options = SmallVillage();
  options.terrain_cell_m = 20;
  const Land land(options);
  const Terrain::Mesh mesh = land.terrain.MakeMesh();
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
    ASSERT_GT((b - a).cross(c - a).z(), 0);
    for (int k = 0; k < 3; ++k) ++edges[std::minmax(t[k], t[(k + 1) % 3])];
  }
  // Every edge has two triangles but for those of the outer rim.
  float reach = 0;
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    ASSERT_TRUE(vertex.allFinite());
    reach = std::max(reach, vertex.x());
  }
  for (const auto& [edge, triangles] : edges) {
    const auto on_rim = [&](uint32_t v) {
      return mesh.vertices[v].head<2>().cwiseAbs().maxCoeff() > reach - 1;
    };
    ASSERT_EQ(triangles, on_rim(edge.first) && on_rim(edge.second) && triangles == 1 ? 1 : 2);
  }
}

TEST(TerrainSeed, DecidesTheHills) {
  SceneOptions options = SmallVillage();
  const Land land(options), again(options);
  options.seed = 2;
  const Land other(options);
  EXPECT_EQ(land.terrain.Height(111, -67), again.terrain.Height(111, -67));
  EXPECT_NE(land.terrain.Height(111, -67), other.terrain.Height(111, -67));
}

/// The land over heights of an image, which holds them as metres.
class TerrainOfImage : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(file_); }
  Land OfHeights(const cv::Mat1f& heights_m) {
    cv::imwrite(file_.string(), heights_m);
    SceneOptions options = FlatLand();
    options.extent_m = 100;
    options.terrain_cell_m = 5;
    options.dem = file_.string();
    options.dem_cell_m = 10;
    return Land(options);
  }

  const std::filesystem::path file_ =
      std::filesystem::temp_directory_path() /
      ("deepuav_terrain_of_image_" + std::to_string(getpid()) + ".tiff");
};

TEST_F(TerrainOfImage, OfOnePixelOrOneRowIsEvenThere) {
  const Land flat = OfHeights(cv::Mat1f(1, 1, 300.0f));
  EXPECT_EQ(flat.terrain.Height(-40, 30), flat.terrain.Height(7, -2));
  cv::Mat1f row(1, 3);
  row << 5, 15, 45;
  const Land ramp = OfHeights(row);
  EXPECT_NEAR(ramp.terrain.Height(10, 40) - ramp.terrain.Height(-10, -40), 40, 1e-5);
  EXPECT_NEAR(ramp.terrain.Height(5, 0) - ramp.terrain.Height(0, 0), 15, 1e-5);
  // Beyond the image its border goes on.
  EXPECT_NEAR(ramp.terrain.Height(50, 0), ramp.terrain.Height(10, 0), 1e-5);
}

TEST_F(TerrainOfImage, LiesAboveTheWaterHoweverLowItIs) {
  cv::Mat1f heights(4, 4, -430.0f);
  heights(2, 2) = -415;
  const Land land = OfHeights(heights);
  for (double x = -50; x <= 50; x += 5) EXPECT_GT(land.terrain.Height(x, x), 0);
}

TEST_F(TerrainOfImage, RefusesHeightsThatAreNone) {
  cv::Mat1f heights(4, 4, 3.0f);
  heights(1, 2) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(OfHeights(heights), Error);
}

}  // namespace
}  // namespace deepuav
