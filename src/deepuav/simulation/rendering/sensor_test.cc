#include "deepuav/simulation/rendering/sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

SensorOptions PlainSensor() {
  SensorOptions options;
  options.vignetting = 0;
  options.defocus_px = 0;
  options.gamma = 1;
  options.read_noise_electrons = 0;
  return options;
}

TEST(Sensor, ShotNoiseHasTheVarianceOfTheElectrons) {
  const SensorOptions options = PlainSensor();
  const Sensor sensor(options, {400, 300}, 3, 2);
  const ExposureSetting exposure{options.sunlit_exposure_s, 1};
  const GreyImage image = sensor.Develop(cv::Mat1f(300, 400, 0.5f), exposure, 0);
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  const double electrons = 0.5 * options.full_well_electrons;
  const double quantisation = 1 / 12.0;
  const double expected = std::sqrt(electrons) / options.full_well_electrons * 255;
  EXPECT_NEAR(mean[0], 127.5, 0.1);
  EXPECT_NEAR(deviation[0], std::sqrt(expected * expected + quantisation), 0.05);
}

TEST(Sensor, DoesNotDependOnThreadsAndDiffersBetweenFrames) {
  const SensorOptions options;
  const cv::Mat1f light(100, 150, 0.3f);
  const ExposureSetting exposure{options.sunlit_exposure_s, 1};
  const GreyImage one = Sensor(options, {150, 100}, 3, 1).Develop(light.clone(), exposure, 7);
  const GreyImage many = Sensor(options, {150, 100}, 3, 5).Develop(light.clone(), exposure, 7);
  const GreyImage next = Sensor(options, {150, 100}, 3, 5).Develop(light.clone(), exposure, 8);
  EXPECT_EQ(cv::countNonZero(one != many), 0);
  EXPECT_GT(cv::countNonZero(one != next), 1000);
}

TEST(Sensor, VignetteDarkensTheCorners) {
  SensorOptions options = PlainSensor();
  options.vignetting = 0.4;
  options.full_well_electrons = 1e8;
  const Sensor sensor(options, {101, 81}, 3, 1);
  const GreyImage image =
      sensor.Develop(cv::Mat1f(81, 101, 0.8f), {options.sunlit_exposure_s, 1}, 0);
  EXPECT_NEAR(image(40, 50), 204, 1);
  EXPECT_NEAR(image(0, 0), 204 * 0.6, 1);
}

TEST(Sensor, ExposureLengthensBeforeTheGainRises) {
  const SensorOptions options;
  const ExposureSetting bright = SettingFor(options, 0.5);
  EXPECT_DOUBLE_EQ(bright.duration_s, 0.5 * options.sunlit_exposure_s);
  EXPECT_EQ(bright.gain, 1);
  const double longest = options.max_exposure_s / options.sunlit_exposure_s;
  const ExposureSetting dim = SettingFor(options, 3 * longest);
  EXPECT_DOUBLE_EQ(dim.duration_s, options.max_exposure_s);
  EXPECT_NEAR(dim.gain, 3, 1e-9);
  EXPECT_EQ(SettingFor(options, 1e6 * longest).gain, options.max_gain);
}

TEST(Sensor, MeteringReachesTheMeanLevel) {
  const SensorOptions options;
  std::vector<float> light;
  for (int i = 1; i <= 100; ++i) light.push_back(0.002f * static_cast<float>(i));
  const double scale = MeteredScale(options, light);
  double mean = 0;
  for (const float value : light)
    mean += std::pow(std::min(1.0, scale * value), 1 / options.gamma) / 100;
  EXPECT_NEAR(mean, options.mean_level, 1e-3);
}

TEST(Sensor, RefusesOptionsOutOfRange) {
  const auto refused = [](const auto& change) {
    SensorOptions options;
    change(&options);
    EXPECT_THROW(options.Check(), Error);
  };
  refused([](SensorOptions* o) { o->samples = 0; });
  refused([](SensorOptions* o) { o->min_exposure_s = 2 * o->max_exposure_s; });
  refused([](SensorOptions* o) { o->jpeg_quality = 101; });
  refused([](SensorOptions* o) { o->mean_level = std::nan(""); });
  WeatherOptions weather;
  weather.sun_elevation_deg = -1;
  EXPECT_THROW(weather.Check(), Error);
}

}  // namespace
}  // namespace deepuav
