#include "deepuav/geometry/camera_scale.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

Camera Lens() {
  return {640, 480, {500, 505, 310, 250}, LensModel::kRadialTangential, {-0.2, 0.05, 0.002, -0.003},
          10};
}

TEST(ScaledCamera, SeesAPointWhereTheResizedImageShowsIt) {
  const Camera camera = Lens(), half = ScaledCamera(camera, 320, 240);
  const Eigen::Vector3d point(0.3, -0.2, 1);
  const Eigen::Vector2d expected =
      0.5 * (*camera.Distort(point) + Eigen::Vector2d(0.5, 0.5)) - Eigen::Vector2d(0.5, 0.5);
  EXPECT_LT((*half.Distort(point) - expected).norm(), 1e-9);
  EXPECT_EQ(half.width, 320);
  EXPECT_EQ(half.rate_hz, 10);
  const Camera back = ScaledCamera(half, 640, 480);
  EXPECT_NEAR(back.pinhole.cx, camera.pinhole.cx, 1e-9);
}

TEST(TurnedCamera, SeesATurnedPointWhereTheTurnedImageShowsIt) {
  const Camera camera = Lens();
  Eigen::Vector3d point(0.3, -0.2, 1);
  Eigen::Vector2d px = *camera.Distort(point);
  int height = camera.height, width = camera.width;
  for (int turns = 1; turns <= 4; ++turns) {
    point = {-point.y(), point.x(), 1};
    px = {height - 1 - px.y(), px.x()};
    std::swap(width, height);
    const Camera turned = TurnedCamera(camera, turns);
    EXPECT_EQ(turned.width, width);
    EXPECT_LT((*turned.Distort(point) - px).norm(), 1e-9) << turns;
  }
  EXPECT_EQ(TurnedCamera(camera, -1).pinhole.cx, TurnedCamera(camera, 3).pinhole.cx);
}

}  // namespace
}  // namespace deepuav
