// Sun, weather and dark in the pictures.

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "deepuav/simulation/testing/small_world.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

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

}  // namespace
}  // namespace deepuav
