#include "deepuav/simulation/renderer.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

SceneOptions SmallScene() {
  SceneOptions scene;
  scene.extent_m = 300;
  scene.town_radius_m = 70;
  scene.lake_radius_m = 25;
  scene.cars_per_km = 60;
  return scene;
}

const World& SmallWorld() {
  static const World world(SmallScene());
  return world;
}

Camera TestCamera(LensModel lens) {
  Camera camera;
  camera.width = 376;
  camera.height = 240;
  camera.pinhole = {230, 229, 183.6, 124.2};
  camera.lens = lens;
  if (lens == LensModel::kRadialTangential) camera.distortion = {-0.283, 0.074, 0.0002, 0.00002};
  if (lens == LensModel::kEquidistant) {
    camera.pinhole = {190, 190, 187.1, 119.4};
    camera.distortion = {-0.01, 0.02, -0.01, 0.002};
  }
  return camera;
}

// A camera that looks down at the given angle, towards `yaw`.
Eigen::Matrix3d Looking(double yaw, double down) {
  const Vector3d forward(std::cos(yaw) * std::cos(down), std::sin(yaw) * std::cos(down),
                         -std::sin(down));
  const Vector3d right(std::sin(yaw), -std::cos(yaw), 0);
  Eigen::Matrix3d rotation;
  rotation << right, forward.cross(right), forward;
  return rotation;
}

// Flies and turns, as a drone in haste.
SE3 Flight(double time_s) {
  const Vector3d position(-20 + 9 * time_s, 10 - 4 * time_s, 45 + 2 * time_s);
  return SE3(Looking(0.4 + 0.8 * time_s, 0.9 + 0.3 * time_s), position);
}

SE3 Still(double) { return Flight(0); }

// Light in, level out: no effect of the lens or sensor, and one exposure.
RenderOptions Linear() {
  RenderOptions options;
  options.sensor.vignetting = 0;
  options.sensor.defocus_px = 0;
  options.sensor.gamma = 1;
  options.sensor.full_well_electrons = 1e9;
  options.sensor.read_noise_electrons = 0;
  options.sensor.sunlit_exposure_s = options.sensor.min_exposure_s = options.sensor.max_exposure_s =
      0.004;
  options.sensor.max_gain = 1;
  return options;
}

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

TEST(Renderer, ThingsCastShadowsAwayFromTheSun) {
  constexpr double kGap = 12;
  const Vector3d at(20, 20, 0);
  const Camera camera = TestCamera(LensModel::kPinhole);
  RenderOptions options = Linear();
  options.weather.clouds = 0;
  SceneOptions scene = SmallScene();
  scene.town_radius_m = scene.relief_m = scene.river_width_m = scene.lake_radius_m = 0;
  scene.cars_per_km = scene.people_per_km = scene.tree_fraction = scene.forest_fraction = 0;
  const World bare(scene);
  const double ground = bare.GroundHeight(at.x(), at.y());
  const double elevation = options.weather.sun_elevation_deg * M_PI / 180;
  const double azimuth = options.weather.sun_azimuth_deg * M_PI / 180;
  const Vector3d sun(std::sin(azimuth) * std::cos(elevation),
                     std::cos(azimuth) * std::cos(elevation), std::sin(elevation));
  const Vector3d ball = at + Vector3d(0, 0, ground) + kGap / sun.z() * sun;
  const World with(scene, {{ball, 1.5}});
  // From the side, so that the ball itself is not in between.
  const SE3 pose(Looking(azimuth, M_PI / 2 - 0.01), at + Vector3d(0, 0, ground + 30));
  const PathOfCamera path = [&](double) { return pose; };
  Renderer sunny(bare, camera, options), shaded(with, camera, options);
  const GreyImage light = sunny.Render(path, 0, 0).image, dark = shaded.Render(path, 0, 0).image;
  const Vector2d pixel = camera.pinhole.Project(pose.Inverse() * (at + Vector3d(0, 0, ground)));
  const cv::Rect middle(static_cast<int>(pixel.x()) - 3, static_cast<int>(pixel.y()) - 3, 7, 7);
  EXPECT_LT(cv::mean(dark(middle))[0], 0.5 * cv::mean(light(middle))[0]);
  const cv::Rect away(middle.x + 60, middle.y, 7, 7);
  EXPECT_NEAR(cv::mean(dark(away))[0], cv::mean(light(away))[0], 1);
}

double Contrast(const GreyImage& image) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  return deviation[0];
}

TEST(Renderer, FogTakesContrastAndDuskLengthensTheExposure) {
  const Camera camera = TestCamera(LensModel::kPinhole);
  RenderOptions clear, fog, dusk;
  fog.weather.visibility_m = 60;
  dusk.weather.sun = 0.01;
  dusk.weather.sky = 0.02;
  dusk.weather.sun_elevation_deg = 3;
  const Rendered in_clear = Renderer(SmallWorld(), camera, clear).Render(Flight, 0, 0);
  const Rendered in_fog = Renderer(SmallWorld(), camera, fog).Render(Flight, 0, 0);
  const Rendered at_dusk = Renderer(SmallWorld(), camera, dusk).Render(Flight, 0, 0);
  EXPECT_LT(Contrast(in_fog.image), 0.5 * Contrast(in_clear.image));
  EXPECT_GT(at_dusk.exposure.duration_s, 4 * in_clear.exposure.duration_s);
  EXPECT_NEAR(cv::mean(in_clear.image)[0], 255 * clear.sensor.mean_level, 20);
}

TEST(Renderer, RainFallsDownInThePicture) {
  const Camera camera = TestCamera(LensModel::kPinhole);
  RenderOptions dry = Linear();
  dry.weather.sky = 1;
  dry.sensor.sunlit_exposure_s = dry.sensor.min_exposure_s = dry.sensor.max_exposure_s = 0.01;
  RenderOptions wet = dry;
  wet.weather.rain_mm_h = 60;
  wet.weather.wind_m_s = 0;

  const PathOfCamera level = [](double) { return SE3(Looking(0.3, 0), Vector3d(0, 0, 40)); };
  const GreyImage without = Renderer(SmallWorld(), camera, dry).Render(level, 0, 0).image;
  const GreyImage with = Renderer(SmallWorld(), camera, wet).Render(level, 0, 0).image;
  // Of a level camera with no wind the streaks run down the columns: neighbours below change alike.
  double down = 0, across = 0;
  int changed = 0;
  for (int y = 1; y < camera.height; ++y) {
    for (int x = 1; x < camera.width; ++x) {
      const auto change = [&](int v, int u) {
        return static_cast<double>(with(v, u)) - without(v, u);
      };
      if (std::abs(change(y, x)) > 2) ++changed;
      down += std::abs(change(y, x) - change(y - 1, x));
      across += std::abs(change(y, x) - change(y, x - 1));
    }
  }
  EXPECT_GT(changed, 100);
  EXPECT_LT(down, 0.6 * across);
}

TEST(Renderer, ABlindSensorSeesNothing) {
  RenderOptions options = Linear();
  options.sensor.blind_at_s = 1;
  options.sensor.blind_for_s = 0.5;
  Renderer renderer(SmallWorld(), TestCamera(LensModel::kPinhole), options);
  const auto mean = [&](double time_s) {
    return cv::mean(renderer.Render(Still, time_s, 0, {}).image)[0];
  };
  EXPECT_GT(mean(0.95), 20);
  EXPECT_EQ(mean(1), 0);
  EXPECT_EQ(mean(1.45), 0);
  EXPECT_GT(mean(1.5), 20);
}

TEST(Renderer, RefusesOptionsAndCamerasOutOfRange) {
  RenderOptions options;
  options.sensor.samples = -1;
  EXPECT_THROW(Renderer(SmallWorld(), TestCamera(LensModel::kPinhole), options), Error);
  Camera camera = TestCamera(LensModel::kPinhole);
  camera.width = 0;
  EXPECT_THROW(Renderer(SmallWorld(), camera, RenderOptions()), Error);
}

TEST(World, HasRoadsARiverAndClearanceOverThem) {
  const World& world = SmallWorld();
  ASSERT_FALSE(world.roads().empty());
  ASSERT_EQ(world.rivers().size(), 1u);
  EXPECT_FALSE(world.CeilingHeight());
  for (const Vector3d& point : world.roads().front().points) {
    EXPECT_NEAR(point.z(), world.GroundHeight(point.x(), point.y()), 1e-6);
  }
  double tallest = 0;
  for (double y = -140; y < 140; y += 4) {
    for (double x = -140; x < 140; x += 4) {
      const double ground = world.GroundHeight(x, y), top = world.ClearanceHeight(x, y);
      EXPECT_GE(top, ground);
      tallest = std::max(tallest, top - ground);
    }
  }
  EXPECT_GT(tallest, 5);
  EXPECT_GE(world.ClearanceHeight(0, 0, 10), world.ClearanceHeight(0, 0));
}

TEST(World, HallHasAFloorAndARoof) {
  const World hall(LoadScene("hall"));
  ASSERT_TRUE(hall.CeilingHeight());
  EXPECT_EQ(hall.GroundHeight(3, 2), 0);
  EXPECT_LT(hall.ClearanceHeight(0, 0), *hall.CeilingHeight());
  const Camera camera = TestCamera(LensModel::kPinhole);
  Renderer renderer(hall, camera, RenderOptions());
  const PathOfCamera path = [](double) { return SE3(Looking(0.2, 0.2), Vector3d(-10, 0, 3)); };
  const Rendered rendered = renderer.Render(path, 0, 0, {true, {}});
  double farthest;
  cv::minMaxLoc(rendered.depth_m, nullptr, &farthest);
  EXPECT_LT(farthest, 2 * hall.HalfExtent().norm());
  EXPECT_GT(Contrast(rendered.image), 20);
}

}  // namespace
}  // namespace deepuav
