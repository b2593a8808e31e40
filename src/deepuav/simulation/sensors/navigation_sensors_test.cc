#include <gtest/gtest.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <vector>

#include "deepuav/simulation/sensors/barometer.h"
#include "deepuav/simulation/sensors/gnss.h"
#include "deepuav/simulation/sensors/sensor_noise.h"
#include "deepuav/simulation/testing/sensor_paths.h"

namespace deepuav {
namespace {

GnssOptions ExactGnss() {
  GnssOptions options;
  options.horizontal_drift_m = options.vertical_drift_m = 0;
  options.horizontal_noise_m = options.vertical_noise_m = 0;
  options.dropouts_per_min = 0;
  return options;
}

std::vector<Eigen::Vector3d> LocalPositions(const GnssOptions& options,
                                            const std::vector<GnssFix>& samples) {
  const GeographicLib::LocalCartesian local(
      options.origin_latitude_deg, options.origin_longitude_deg, options.origin_altitude_m);
  std::vector<Eigen::Vector3d> positions;
  for (const GnssFix& sample : samples) {
    Eigen::Vector3d& p = positions.emplace_back();
    local.Forward(sample.latitude_deg, sample.longitude_deg, *sample.altitude_m, p.x(), p.y(),
                  p.z());
  }
  return positions;
}

TEST(Gnss, IsThePlaceOfTheAntenna) {
  GnssOptions options = ExactGnss();
  options.lever_x_m = 0.5;
  options.lever_y_m = -0.3;
  options.lever_z_m = 0.2;
  options.clock_offset_s = 0.25;
  Random random(1);
  const QuadrotorPath path = BentPath();
  const std::vector<GnssFix> samples = SimulateGnss(path, options, 30, kStart, &random);
  ASSERT_EQ(samples.size(), 151);
  const std::vector<Eigen::Vector3d> found = LocalPositions(options, samples);
  for (size_t i = 0; i < samples.size(); ++i) {
    const SE3 pose = path.At(0.2 * static_cast<double>(i)).world_from_body;
    EXPECT_LT((found[i] - pose * Eigen::Vector3d(0.5, -0.3, 0.2)).norm(), 1e-6);
    EXPECT_GT((found[i] - pose.translation()).norm(), 0.6);
  }
  EXPECT_EQ(samples[1].time.nanoseconds, kStart.nanoseconds + 450'000'000);
}

TEST(Gnss, NoiseHasTheAskedDeviationAndCorrelation) {
  GnssOptions options;
  options.drift_correlation_s = 5;
  options.dropouts_per_min = 0;
  options.lever_x_m = options.lever_z_m = 0;
  Random random(2);
  const double duration_s = 20000;
  const std::vector<GnssFix> samples =
      SimulateGnss(StillPath(duration_s), options, duration_s, kStart, &random);
  const std::vector<Eigen::Vector3d> found = LocalPositions(options, samples);
  const auto covariance = [&](int axis, size_t lag) {
    double sum = 0;
    for (size_t i = lag; i < found.size(); ++i)
      sum += (found[i][axis] - Eigen::Vector3d(100, 200, 50)[axis]) *
             (found[i - lag][axis] - Eigen::Vector3d(100, 200, 50)[axis]);
    return sum / static_cast<double>(found.size() - lag);
  };
  // 4000 independent spells of drift: the variance is known to about 3 %.
  for (const int axis : {0, 1, 2}) {
    const double drift = axis == 2 ? 1.5 : 0.8, noise = axis == 2 ? 0.3 : 0.15;
    EXPECT_NEAR(covariance(axis, 0) / (drift * drift + noise * noise), 1, 0.1) << axis;
    EXPECT_NEAR(covariance(axis, 25) / (drift * drift * std::exp(-1.0)), 1, 0.25) << axis;
    EXPECT_NEAR(covariance(axis, 0) - covariance(axis, 1) - drift * drift * (1 - std::exp(-0.04)),
                noise * noise, 0.02)
        << axis;
    EXPECT_NEAR(samples[0].sigma_m[axis], std::hypot(drift, noise), 1e-12);
  }
}

TEST(Gnss, DropsOutAsOftenAndAsLongAsAsked) {
  GnssOptions options = ExactGnss();
  options.dropouts_per_min = 3;
  options.dropout_s = 4;
  Random random(3);
  const double duration_s = 20000;
  const std::vector<GnssFix> samples =
      SimulateGnss(StillPath(duration_s), options, duration_s, kStart, &random);
  // Mean 20 s with fixes, then 4 s without.
  const double share = static_cast<double>(samples.size()) / (5 * duration_s);
  EXPECT_NEAR(share, 20.0 / 24, 0.02);
  int gaps = 0;
  for (size_t i = 1; i < samples.size(); ++i)
    gaps += SecondsBetween(samples[i - 1].time, samples[i].time) > 0.21;
  EXPECT_NEAR(gaps / (duration_s / 24), 1, 0.15);
}

TEST(Barometer, PressureIsThatOfTheStandardAtmosphere) {
  // ISO 2533, table 5.
  EXPECT_NEAR(StandardPressurePa(0), 101325, 0.5);
  EXPECT_NEAR(StandardPressurePa(1000), 89874.6, 1);
  EXPECT_NEAR(StandardPressurePa(5000), 54019.9, 2);
  for (const double altitude : {-100.0, 0.0, 488.0, 3000.0})
    EXPECT_NEAR(StandardAltitudeM(StandardPressurePa(altitude)), altitude, 1e-6);
}

TEST(Barometer, NoiseAndDriftAreAsAsked) {
  BarometerOptions options;
  options.drift_correlation_s = 10;
  Random random(4);
  const double duration_s = 20000;
  const auto samples =
      SimulateBarometer(StillPath(duration_s), options, 400, duration_s, kStart, &random);
  double variance = 0, steps = 0;
  for (size_t i = 1; i < samples.size(); ++i) {
    const double error = samples[i].altitude_m - 450;
    const double step = samples[i].altitude_m - samples[i - 1].altitude_m;
    variance += error * error / static_cast<double>(samples.size() - 1);
    steps += step * step / static_cast<double>(samples.size() - 1);
    ASSERT_NEAR(StandardAltitudeM(samples[i].pressure_pa), samples[i].altitude_m, 1e-6);
  }
  EXPECT_NEAR(variance / (0.5 * 0.5 + 0.1 * 0.1), 1, 0.15);
  EXPECT_NEAR(steps, 2 * 0.1 * 0.1 + 2 * 0.25 * (1 - std::exp(-0.005)), 5e-4);
}

TEST(StreamOf, GivesSensorsGeneratorsOfTheirOwn) {
  Random a = StreamOf(1, 1), again = StreamOf(1, 1), b = StreamOf(1, 2), c = StreamOf(2, 1);
  const double first = a.Uniform(0, 1);
  EXPECT_EQ(first, again.Uniform(0, 1));
  EXPECT_NE(first, b.Uniform(0, 1));
  EXPECT_NE(first, c.Uniform(0, 1));
}

}  // namespace
}  // namespace deepuav
