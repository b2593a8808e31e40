#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/random.h"
#include "deepuav/simulation/rendering/camera_rays.h"
#include "deepuav/simulation/rendering/flow.h"
#include "deepuav/simulation/rendering/rain.h"
#include "deepuav/simulation/world/hall.h"

namespace deepuav {
namespace {

Camera SmallCamera() {
  return {64, 48, {45, 46, 31.5, 23.5}, LensModel::kRadialTangential, {-0.1, 0.01, 0.001, -0.001},
          20};
}

TEST(CameraRays, AreThoseOfTheCamera) {
  const Camera camera = SmallCamera();
  const CameraRays rays(camera, 1);
  for (int y = 0; y < camera.height; y += 7) {
    for (int x = 0; x < camera.width; x += 5) {
      const auto undistorted = camera.Undistort({x, y});
      ASSERT_TRUE(undistorted);
      const Eigen::Vector2d expected = camera.pinhole.Unproject(*undistorted).head<2>();
      EXPECT_LT((rays.At(x, y).cast<double>() - expected).norm(), 1e-6);
    }
  }
  const Eigen::Vector2f between = rays.At(10, 10, {0.5f, 0});
  EXPECT_LT((between - 0.5f * (rays.At(10, 10) + rays.At(11, 10))).norm(), 1e-4f);
}

TEST(CameraRays, DoNotDependOnThreads) {
  const Camera camera = SmallCamera();
  const CameraRays one(camera, 1), four(camera, 4);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) EXPECT_EQ(one.At(x, y), four.At(x, y));
  }
}

TEST(RowwiseProjection, OfAGlobalShutterIsTheCamerasOwn) {
  const Camera camera = SmallCamera();
  const SE3 world_from_cam(RotationExp({0.1, -0.2, 0.3}), {1, 2, 3});
  const RowwiseProjection projection(camera, true, [&](double) { return world_from_cam; });
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d point_cam(random.Uniform(-2, 2), random.Uniform(-1.5, 1.5), 4);
    const Eigen::Vector3d point = world_from_cam * point_cam;
    const auto expected = camera.Distort(point_cam);
    const auto pixel = projection.Project([&](double) { return point; }, 20);
    ASSERT_EQ(pixel.has_value(), expected.has_value());
    if (pixel) {
      EXPECT_LT((*pixel - *expected).norm(), 1e-6);
    }
  }
}

TEST(RowwiseProjection, OfARollingShutterEveryPointIsSeenAtItsOwnRowsMoment) {
  const Camera camera = SmallCamera();
  const auto pose = [](double row) { return SE3(RotationExp({0, 0.001 * row, 0}), {0, 0, 0}); };
  const RowwiseProjection projection(camera, false, pose);
  Random random(2);
  int seen = 0;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d point(random.Uniform(-1, 1), random.Uniform(-1, 1), 4);
    const auto pixel = projection.Project([&](double) { return point; }, 20);
    if (!pixel) continue;
    ++seen;
    const auto then = camera.Distort(pose(pixel->y()).Inverse() * point);
    ASSERT_TRUE(then);
    EXPECT_LT((*then - *pixel).norm(), 0.05) << pixel->transpose();
  }
  EXPECT_GT(seen, 30);
}

TEST(RowwiseProjection, SeesNothingBehindTheCamera) {
  const Camera camera = SmallCamera();
  const RowwiseProjection projection(camera, true, [](double) { return SE3(); });
  const Eigen::Vector3d behind(0, 0, -2);
  EXPECT_FALSE(projection.Project([&](double) { return behind; }, 20));
}

TEST(Rain, NoneDrawsNothingAndMoreDrawsMore) {
  const Camera camera = SmallCamera();
  const RainView view{SE3(), SE3(), 0, 0.01, 0.8f};
  double last = -1;
  for (const double rain_mm_h : {0.0, 20.0, 200.0}) {
    WeatherOptions weather;
    weather.rain_mm_h = rain_mm_h;
    cv::Mat1f radiance(camera.height, camera.width, 0.2f);
    DrawRain(weather, camera, view, 5, &radiance);
    const double change = cv::norm(radiance - 0.2, cv::NORM_L1);
    EXPECT_GT(change, last) << rain_mm_h;
    EXPECT_TRUE(cv::checkRange(radiance));
    if (rain_mm_h == 0) {
      EXPECT_EQ(change, 0);
    }
    last = change;
  }
}

TEST(Hall, IsAClosedRoomOfTheAskedLength) {
  SceneOptions options;
  options.kind = "hall";
  options.extent_m = 40;
  const Hall hall = MakeHall(options);
  EXPECT_NEAR(hall.half_extent_m.x(), 20, 1e-9);
  EXPECT_GT(hall.half_extent_m.y(), 2);
  EXPECT_GT(hall.ceiling_m, 3);
}

}  // namespace
}  // namespace deepuav
