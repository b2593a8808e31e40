#include "deepuav/simulation/rendering/view_from_above.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

SceneOptions SmallVillage() {
  SceneOptions scene;
  scene.extent_m = 300;
  scene.town_radius_m = 60;
  return scene;
}

TEST(ViewFromAbove, HasTheWorldsHeights) {
  const World world(SmallVillage());
  constexpr double kCell_m = 1;
  const cv::Size size(60, 40);
  const auto place_of = [&](double column, double row) {
    return Eigen::Vector2d(column - 30, 20 - row);
  };
  const ViewFromAbove view = LookDown(world, {}, size, kCell_m, place_of);
  int on_ground = 0;
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const Eigen::Vector2d place = place_of(column + 0.25, row + 0.25);
      const double ground = world.GroundHeight(place.x(), place.y());
      EXPECT_GT(view.height_m(row, column), ground - 1.5) << column << " " << row;
      EXPECT_LT(view.height_m(row, column), 60);
      if (std::abs(view.height_m(row, column) - ground) < 0.5) ++on_ground;
      EXPECT_GT(view.radiance(row, column), 0);
    }
  }
  EXPECT_GT(on_ground, size.area() / 4);
}

TEST(ViewFromAbove, AHallHasARoof) {
  SceneOptions scene;
  scene.kind = "hall";
  const World world(scene);
  EXPECT_THROW(
      LookDown(world, {}, {8, 8}, 1, [](double x, double y) { return Eigen::Vector2d(x, y); }),
      Error);
}

}  // namespace
}  // namespace deepuav
