#include "deepuav/simulation/rendering/rain.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/simulation/testing/small_world.h"

namespace deepuav {
namespace {

constexpr float kSky = 0.2f, kDrop = 0.8f;

/// The light that drops add, seen by a level camera.
struct Shower {
  double rain_mm_h = 30, wind_m_s = 0;
  double start_s = 0, exposure_s = 0.01;
  uint64_t seed = 5;
  float drop_radiance = kDrop;
  SE3 start = SE3(Looking(0, 0), {0, 0, 30}), end = start;

  cv::Mat1f Draw() const {
    WeatherOptions weather;
    weather.rain_mm_h = rain_mm_h;
    weather.wind_m_s = wind_m_s;
    const Camera camera = TestCamera(LensModel::kPinhole);
    cv::Mat1f radiance(camera.height, camera.width, kSky);
    DrawRain(weather, camera, {start, end, start_s, start_s + exposure_s, drop_radiance}, seed,
             &radiance);
    return radiance;
  }
  double Added() const { return cv::norm(Draw() - kSky, cv::NORM_L1); }
};

/// Mean products of the differences along x and y: streaks are along the direction of least change.
double StreakAngle(const cv::Mat1f& picture) {
  double xx = 0, xy = 0, yy = 0;
  for (int y = 1; y + 1 < picture.rows; ++y) {
    for (int x = 1; x + 1 < picture.cols; ++x) {
      const double dx = picture(y, x + 1) - picture(y, x - 1);
      const double dy = picture(y + 1, x) - picture(y - 1, x);
      xx += dx * dx, xy += dx * dy, yy += dy * dy;
    }
  }
  return 0.5 * std::atan2(2 * xy, xx - yy) + M_PI / 2;
}

TEST(RainStreaks, ArePlumbWithoutWindAndLeanWithIt) {
  Shower shower;
  shower.exposure_s = 0.02;
  // The camera looks along x, as the wind blows: from the side it is across the view.
  shower.start = shower.end = SE3(Looking(M_PI / 2, 0), {0, 0, 30});
  EXPECT_NEAR(StreakAngle(shower.Draw()), M_PI / 2, 0.05);
  shower.wind_m_s = 7;
  const double leaning = StreakAngle(shower.Draw());
  // About as fast as drops fall: some 45 degrees, to the right and down.
  EXPECT_NEAR(std::abs(leaning - M_PI / 2), M_PI / 4, 0.2);
  shower.wind_m_s = -7;
  EXPECT_NEAR(StreakAngle(shower.Draw()) + leaning, M_PI, 0.1);
}

TEST(RainStreaks, FollowTheCamerasMotionToo) {
  // A camera that falls as a drop does sees it stand: no streaks.
  Shower still, falling;
  still.exposure_s = falling.exposure_s = 0.02;
  falling.end = SE3(falling.start.rotation(),
                    falling.start.translation() - Eigen::Vector3d(0, 0, 0.02 * 7.5));
  const auto steepness = [](const cv::Mat1f& picture) {
    return cv::norm(picture.rowRange(1, picture.rows) - picture.rowRange(0, picture.rows - 1));
  };
  EXPECT_GT(steepness(falling.Draw()), 1.5 * steepness(still.Draw()));
}

TEST(RainAmount, AddsLightInProportion) {
  Shower light, heavy;
  light.rain_mm_h = 10;
  heavy.rain_mm_h = 40;
  EXPECT_NEAR(heavy.Added() / light.Added(), 4, 0.8);
}

TEST(RainAmount, NeverLeavesTheRangeBetweenBackgroundAndDrop) {
  for (const float drop : {0.0f, kDrop}) {
    Shower shower;
    shower.rain_mm_h = 200;
    shower.drop_radiance = drop;
    const cv::Mat1f picture = shower.Draw();
    double low, high;
    cv::minMaxLoc(picture, &low, &high);
    EXPECT_GE(low, std::min(kSky, drop) - 1e-6);
    EXPECT_LE(high, std::max(kSky, drop) + 1e-6);
    EXPECT_GT(high - low, 0.02);
  }
}

TEST(RainSeed, DecidesTheDropsWhichGoOnFalling) {
  const Shower shower;
  Shower other = shower, later = shower, elsewhere = shower;
  EXPECT_EQ(cv::norm(shower.Draw(), Shower().Draw()), 0);
  other.seed = 6;
  EXPECT_GT(cv::norm(shower.Draw(), other.Draw()), 0.1);
  later.start_s = 0.05;
  EXPECT_GT(cv::norm(shower.Draw(), later.Draw()), 0.1);
  EXPECT_NEAR(later.Added() / shower.Added(), 1, 0.3);
  // Drops fill all of space evenly.
  elsewhere.start = elsewhere.end = SE3(Looking(1, 0.2), {-531, 200, 90});
  EXPECT_NEAR(elsewhere.Added() / shower.Added(), 1, 0.3);
}

}  // namespace
}  // namespace deepuav
