#include "deepuav/simulation/world/water.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

SceneOptions Scene(double river_width_m, double lake_radius_m) {
  SceneOptions scene;
  scene.extent_m = 600;
  scene.river_width_m = river_width_m;
  scene.lake_radius_m = lake_radius_m;
  return scene;
}

TEST(Water, IsNowhereWhereNoneWasAsked) {
  const Water dry(Scene(0, 0));
  EXPECT_FALSE(dry.any());
  EXPECT_TRUE(dry.RiverLine().empty());
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const auto x = static_cast<float>(random.Uniform(-300, 300)),
               y = static_cast<float>(random.Uniform(-300, 300));
    EXPECT_GT(dry.ShoreDistance(x, y), 0);
  }
}

TEST(Water, TheRiverHasItsWidthAboutItsLine) {
  constexpr float kWidth_m = 20;
  const Water water(Scene(kWidth_m, 0));
  const std::vector<Eigen::Vector2d> line = water.RiverLine();
  ASSERT_GT(line.size(), 10u);
  for (const Eigen::Vector2d& middle : line) {
    const float distance_m =
        water.ShoreDistance(static_cast<float>(middle.x()), static_cast<float>(middle.y()));
    EXPECT_NEAR(distance_m, -kWidth_m / 2, 0.15 * kWidth_m);
  }
}

TEST(Water, TheLakeIsAboutAsLargeAsAsked) {
  constexpr double kRadius_m = 80;
  const Water water(Scene(0, kRadius_m));
  constexpr double kStep_m = 4, kHalf_m = 300;
  double area_m2 = 0;
  for (double x = -kHalf_m; x < kHalf_m; x += kStep_m) {
    for (double y = -kHalf_m; y < kHalf_m; y += kStep_m)
      area_m2 += water.InLake({x, y}) ? kStep_m * kStep_m : 0;
  }
  const double round_m2 = M_PI * kRadius_m * kRadius_m;
  EXPECT_GT(area_m2, 0.5 * round_m2);
  EXPECT_LT(area_m2, 1.7 * round_m2);
}

TEST(Water, ShoreDistanceIsContinuousAndTellsTheLake) {
  const Water water(Scene(18, 70));
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d at(random.Uniform(-290, 290), random.Uniform(-290, 290));
    const auto x = static_cast<float>(at.x()), y = static_cast<float>(at.y());
    const float here = water.ShoreDistance(x, y);
    ASSERT_TRUE(std::isfinite(here));
    EXPECT_NEAR(water.ShoreDistance(x + 0.01f, y), here, 0.1f);
    // What counts as the lake reaches a few metres over its shore.
    if (water.InLake(at)) {
      EXPECT_LT(here, 6.0f);
    }
  }
}

TEST(Water, FollowsFromTheSeed) {
  SceneOptions scene = Scene(18, 70);
  const Water first(scene), again(scene);
  scene.seed = 2;
  const Water other(scene);
  int differ = 0;
  for (int i = -10; i <= 10; ++i) {
    const auto x = static_cast<float>(20 * i);
    EXPECT_EQ(first.ShoreDistance(x, 5), again.ShoreDistance(x, 5));
    differ += first.ShoreDistance(x, 5) != other.ShoreDistance(x, 5);
  }
  EXPECT_GT(differ, 10);
}

}  // namespace
}  // namespace deepuav
