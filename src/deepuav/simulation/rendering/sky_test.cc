#include "deepuav/simulation/rendering/sky.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

const MaterialTextures& Textures() {
  static const MaterialTextures textures(7);
  return textures;
}

Eigen::Vector3f AnyDirection(Random* random) {
  return Eigen::Vector3d(random->Gaussian(1), random->Gaussian(1), random->Gaussian(1))
      .normalized()
      .cast<float>();
}

TEST(Sky, TheSunStandsWhereElevationAndAzimuthSay) {
  WeatherOptions weather;
  weather.sun_elevation_deg = 30;
  for (const auto& [azimuth_deg, x, y] :
       {std::tuple(0.0, 0.0, 1.0), {90.0, 1.0, 0.0}, {180.0, 0.0, -1.0}, {-90.0, -1.0, 0.0}}) {
    weather.sun_azimuth_deg = azimuth_deg;
    const Eigen::Vector3f sun = Sky(weather, Textures()).sun_direction();
    EXPECT_NEAR(sun.z(), 0.5, 1e-6);
    EXPECT_NEAR(sun.x(), x * std::sqrt(0.75), 1e-6) << azimuth_deg;
    EXPECT_NEAR(sun.y(), y * std::sqrt(0.75), 1e-6) << azimuth_deg;
  }
}

TEST(Sky, IsBrightestAboutTheSunAndAtTheHorizon) {
  WeatherOptions weather;
  weather.clouds = 0;
  weather.sun_elevation_deg = 60;
  const Sky sky(weather, Textures());
  const Eigen::Vector3f sun = sky.sun_direction();
  const Eigen::Vector3f away(-sun.x(), -sun.y(), sun.z());
  EXPECT_GT(sky.Radiance(sun), sky.Radiance(away));
  const Eigen::Vector3f low = Eigen::Vector3f(-sun.x(), -sun.y(), 0.02f).normalized();
  EXPECT_GT(sky.Radiance(low), sky.Radiance(away));
}

TEST(Sky, CloudsTurnAClearSkyIntoAnother) {
  WeatherOptions weather;
  weather.clouds = 0;
  const Sky clear(weather, Textures());
  weather.clouds = 1;
  const Sky covered(weather, Textures());
  Random random(1);
  int changed = 0;
  constexpr int kTries = 200;
  for (int i = 0; i < kTries; ++i) {
    Eigen::Vector3f up = AnyDirection(&random);
    up.z() = std::abs(up.z()) + 0.3f;
    up.normalize();
    changed += std::abs(clear.Radiance(up) - covered.Radiance(up)) > 0.01f;
  }
  EXPECT_GT(changed, kTries / 2);
}

TEST(Sky, HazeLeavesFivePercentOfContrastAtTheVisibility) {
  WeatherOptions weather;
  weather.visibility_m = 2000;
  const Sky sky(weather, Textures());
  const Eigen::Vector3f ahead(1, 0, 0);
  for (const auto& [distance_m, contrast] :
       {std::pair(0.0f, 1.0f), {2000.0f, 0.05f}, {4000.0f, 0.0025f}}) {
    const float difference = sky.Hazed(1, distance_m, ahead) - sky.Hazed(0, distance_m, ahead);
    EXPECT_NEAR(difference, contrast, 1e-3f) << distance_m;
  }
}

TEST(Sky, LightIsFiniteAndNotNegativeAtEveryBoundOfTheWeather) {
  Random random(2);
  for (const double sun : {0.0, 100.0}) {
    for (const double strength : {1e-6, 100.0}) {
      for (const double visibility_m : {1.0, 1e7}) {
        WeatherOptions weather;
        weather.sun = sun;
        weather.sky = strength;
        weather.visibility_m = visibility_m;
        weather.Check();
        const Sky sky(weather, Textures());
        for (int i = 0; i < 50; ++i) {
          const Eigen::Vector3f direction = AnyDirection(&random);
          for (const float light :
               {sky.Radiance(direction), sky.Ambient(direction), sky.Hazed(0.5f, 500, direction)}) {
            EXPECT_TRUE(std::isfinite(light));
            EXPECT_GE(light, 0);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace deepuav
