#include "deepuav/simulation/rendering/renderer.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"
#include "deepuav/simulation/testing/small_world.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct LensAndShutter {
  LensModel lens;
  double readout_s;
};

class MarkerTest : public ::testing::TestWithParam<LensAndShutter> {};

// The truth that matters: what is at a known place appears where the written pose and calibration
// put it.
TEST_P(MarkerTest, LiesWhereItProjects) {
  const Camera camera = TestCamera(GetParam().lens);
  RenderOptions options = Linear();
  options.weather.sun = 0;
  options.weather.visibility_m = 1e7;
  options.sensor.samples = 16;
  options.sensor.rolling_shutter_readout_s = GetParam().readout_s;
  constexpr double kTime = 0.3, kDistance = 12, kRadiusPx = 4;

  std::vector<Marker> markers;
  for (const double u : {60.0, 180.0, 310.0}) {
    for (const double v : {40.0, 130.0, 205.0}) {
      const auto pixel = camera.Undistort({u, v});
      ASSERT_TRUE(pixel);
      const Vector3d ray = camera.pinhole.Unproject(*pixel).normalized();
      markers.push_back(
          {Flight(kTime) * (kDistance * ray), kRadiusPx / camera.pinhole.fx * kDistance});
    }
  }
  SceneOptions scene = SmallScene();
  scene.extent_m = 120;
  scene.river_width_m = scene.cars_per_km = scene.people_per_km = 0;
  const World with(scene, markers), without(scene);
  Renderer renderer(with, camera, options), plain(without, camera, options);
  const GreyImage marked = renderer.Render(Flight, kTime, 0).image;
  const GreyImage bare = plain.Render(Flight, kTime, 0).image;

  for (const Marker& marker : markers) {
    double row = 120;
    Vector2d expected;
    for (int round = 0; round < 5; ++round) {
      const SE3 pose = Flight(renderer.RowTime(kTime, row));
      expected = camera.Distort(pose.Inverse() * marker.position).value();
      row = expected.y();
    }
    Vector2d sum = Vector2d::Zero();
    double weights = 0;
    constexpr int kReach = 14;
    const int cx = static_cast<int>(std::lround(expected.x())),
              cy = static_cast<int>(std::lround(expected.y()));
    for (int y = std::max(0, cy - kReach); y <= std::min(camera.height - 1, cy + kReach); ++y) {
      for (int x = std::max(0, cx - kReach); x <= std::min(camera.width - 1, cx + kReach); ++x) {
        // The share of the pixel that the marker covers.
        const double share = (marked(y, x) - bare(y, x)) / (255.0 - bare(y, x));
        sum += share * Vector2d(x, y);
        weights += share;
      }
    }
    ASSERT_GT(weights, 20);
    EXPECT_NEAR(sum.x() / weights, expected.x(), 0.1);
    EXPECT_NEAR(sum.y() / weights, expected.y(), 0.1);
  }
}

INSTANTIATE_TEST_SUITE_P(LensesAndShutters, MarkerTest,
                         ::testing::Values(LensAndShutter{LensModel::kPinhole, 0},
                                           LensAndShutter{LensModel::kRadialTangential, 0},
                                           LensAndShutter{LensModel::kEquidistant, 0},
                                           LensAndShutter{LensModel::kRadialTangential, 0.03}));

TEST(Renderer, DepthPutsTheGroundWhereItIs) {
  const Camera camera = TestCamera(LensModel::kRadialTangential);
  RenderOptions options;
  options.sensor.rolling_shutter_readout_s = 0.025;
  Renderer renderer(SmallWorld(), camera, options);
  const Rendered rendered = renderer.Render(Flight, 0.2, 0, {true, {}});
  int ground = 0;
  for (int y = 0; y < camera.height; y += 5) {
    const SE3 pose = Flight(renderer.RowTime(0.2, y));
    for (int x = 0; x < camera.width; x += 5) {
      if (rendered.depth_m(y, x) <= 0) continue;
      const auto pixel = camera.Undistort(Vector2d(x, y));
      const Vector3d point = pose * (rendered.depth_m(y, x) * camera.pinhole.Unproject(*pixel));
      if (point.head<2>().cwiseAbs().maxCoeff() > 149) continue;
      const double height = SmallWorld().GroundHeight(point.x(), point.y());
      EXPECT_GT(point.z(), std::min(height, 0.0) - 0.02);
      const double top = SmallWorld().ClearanceHeight(point.x(), point.y());
      if (top > height + 0.001) continue;
      if (std::abs(point.z() - height) < 0.02) ++ground;
    }
  }
  EXPECT_GT(ground, 1000);
}

TEST(Renderer, FlowIsTheMotionOfStandingPoints) {
  const Camera camera = TestCamera(LensModel::kRadialTangential);
  RenderOptions options;
  options.sensor.rolling_shutter_readout_s = 0.02;
  constexpr double kFrom = 0.1, kTo = 0.15;
  Renderer renderer(SmallWorld(), camera, options);
  const Rendered first = renderer.Render(Flight, kFrom, 0, {true, kTo});
  const Rendered second = renderer.Render(Flight, kTo, 1);
  int compared = 0, agree = 0;
  double warped = 0, unwarped = 0;
  for (int y = 20; y < camera.height - 20; y += 3) {
    for (int x = 20; x < camera.width - 20; x += 3) {
      const cv::Vec2f flow = first.flow_px(y, x);
      if (std::isnan(flow[0])) continue;
      const Vector2d to(x + flow[0], y + flow[1]);
      if (to.x() < 0 || to.y() < 0 || to.x() > camera.width - 2 || to.y() > camera.height - 2)
        continue;
      const Vector3d point =
          Flight(renderer.RowTime(kFrom, y)) *
          (first.depth_m(y, x) * camera.pinhole.Unproject(*camera.Undistort(Vector2d(x, y))));
      const auto expected = camera.Distort(Flight(renderer.RowTime(kTo, to.y())).Inverse() * point);
      ++compared;
      if ((*expected - to).norm() < 0.05) ++agree;
      const int xi = static_cast<int>(to.x()), yi = static_cast<int>(to.y());
      const double fx = to.x() - xi, fy = to.y() - yi;
      const GreyImage& image = second.image;
      const double there = (1 - fy) * ((1 - fx) * image(yi, xi) + fx * image(yi, xi + 1)) +
                           fy * ((1 - fx) * image(yi + 1, xi) + fx * image(yi + 1, xi + 1));
      warped += std::abs(there - first.image(y, x));
      unwarped += std::abs(second.image(y, x) - first.image(y, x));
    }
  }
  ASSERT_GT(compared, 3000);
  EXPECT_GT(agree, 0.95 * compared);  // The rest are on moving cars.
  EXPECT_LT(warped, 0.5 * unwarped);
}

TEST(Renderer, FlowOfMovingThingsLeadsThereAndBack) {
  const Camera camera = TestCamera(LensModel::kPinhole);
  constexpr double kFrom = 2, kTo = 2.1;
  Renderer renderer(SmallWorld(), camera, RenderOptions());
  const Rendered first = renderer.Render(Still, kFrom, 0, {false, kTo});
  const Rendered second = renderer.Render(Still, kTo, 1, {false, kFrom});
  int moving = 0, back = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const cv::Vec2f flow = first.flow_px(y, x);
      if (std::isnan(flow[0]) || cv::norm(flow) < 0.5) continue;
      const int tx = static_cast<int>(std::lround(x + flow[0])),
                ty = static_cast<int>(std::lround(y + flow[1]));
      if (tx < 0 || ty < 0 || tx >= camera.width || ty >= camera.height) continue;
      ++moving;
      if (cv::norm(second.flow_px(ty, tx) + flow) < 0.3) ++back;
    }
  }
  ASSERT_GT(moving, 30);
  EXPECT_GT(back, 0.7 * moving);
}

TEST(Renderer, MarksWhatMovesAndItsShadow) {
  const Camera camera = TestCamera(LensModel::kPinhole);
  constexpr double kFrom = 2, kTo = 2.1;
  Renderer renderer(SmallWorld(), camera, RenderOptions());
  const Rendered rendered = renderer.Render(Still, kFrom, 0, {true, kTo, true, false});
  EXPECT_TRUE(rendered.image.empty());
  const Rendered empty_road = [&] {
    SceneOptions scene = SmallScene();
    scene.cars_per_km = scene.people_per_km = 0;
    const World world(scene);
    return Renderer(world, camera, RenderOptions()).Render(Still, kFrom, 0, {true, {}, true});
  }();
  EXPECT_EQ(cv::countNonZero(empty_road.moving), 0);
  // From a camera that holds still only what moves flows, and only what moves hides the road.
  const cv::Mat1b things = rendered.moving == kMoving;
  const cv::Mat1b nearer = rendered.depth_m < empty_road.depth_m;
  EXPECT_GT(cv::countNonZero(things), 30);
  EXPECT_EQ(cv::countNonZero(nearer & ~things), 0);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const cv::Vec2f flow = rendered.flow_px(y, x);
      if (std::isnan(flow[0]) || cv::norm(flow) < 0.5) continue;
      EXPECT_EQ(rendered.moving(y, x), kMoving);
    }
  }
  // Shadows are darker than the same ground of the empty road.
  const Rendered picture = renderer.Render(Still, kFrom, 0);
  const cv::Mat1b shadows = rendered.moving == kMovingShadow;
  ASSERT_GT(cv::countNonZero(shadows), 10);
  EXPECT_LT(cv::mean(picture.image, shadows)[0], 0.9 * cv::mean(empty_road.image, shadows)[0]);
}

TEST(Renderer, DoesNotDependOnThreadsOrOrder) {
  const Camera camera = TestCamera(LensModel::kRadialTangential);
  RenderOptions options;
  options.sensor.samples = 3;
  options.sensor.rolling_shutter_readout_s = 0.02;
  options.weather.rain_mm_h = 10;
  options.threads = 1;
  Renderer one(SmallWorld(), camera, options);
  options.threads = 3;
  Renderer many(SmallWorld(), camera, options);
  const Rendered early = one.Render(Flight, 0.1, 2, {true, 0.2});
  one.Render(Flight, 0.5, 10);
  many.Render(Flight, 0.3, 6);
  const Rendered again = many.Render(Flight, 0.1, 2, {true, 0.2});
  EXPECT_EQ(cv::countNonZero(early.image != again.image), 0);
  EXPECT_EQ(cv::countNonZero(early.depth_m != again.depth_m), 0);
  EXPECT_EQ(early.exposure.duration_s, again.exposure.duration_s);
}

// Rays are traced in tiles: those that the picture's border cuts are filled too.
TEST(Renderer, FillsPicturesOfOddSize) {
  Camera odd = TestCamera(LensModel::kPinhole);
  odd.width = 37, odd.height = 21;
  odd.pinhole.cx = 18, odd.pinhole.cy = 10;
  Camera even = odd;
  even.width = 40, even.height = 24;
  const Rendered cut = Renderer(SmallWorld(), odd, Linear()).Render(Still, 0, 0, {true, {}});
  const Rendered whole = Renderer(SmallWorld(), even, Linear()).Render(Still, 0, 0, {true, {}});
  const cv::Rect shared(0, 0, odd.width, odd.height);
  EXPECT_EQ(cv::countNonZero(cut.depth_m != whole.depth_m(shared)), 0);
  EXPECT_GT(cv::countNonZero(cut.depth_m), 0);
  EXPECT_LT(cv::norm(cut.image, whole.image(shared), cv::NORM_INF), 2);
}

TEST(Renderer, RefusesOptionsAndCamerasOutOfRange) {
  RenderOptions options;
  options.sensor.samples = -1;
  EXPECT_THROW(Renderer(SmallWorld(), TestCamera(LensModel::kPinhole), options), Error);
  Camera camera = TestCamera(LensModel::kPinhole);
  camera.width = 0;
  EXPECT_THROW(Renderer(SmallWorld(), camera, RenderOptions()), Error);
}

}  // namespace
}  // namespace deepuav
