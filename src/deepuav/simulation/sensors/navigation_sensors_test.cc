#include <gtest/gtest.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <functional>

#include "deepuav/simulation/flight/quadrotor_path.h"
#include "deepuav/simulation/sensors/barometer.h"
#include "deepuav/simulation/sensors/gnss.h"
#include "deepuav/simulation/sensors/imu.h"
#include "deepuav/simulation/sensors/sensor_noise.h"

namespace deepuav {
namespace {

constexpr Timestamp kStart{1'700'000'000'000'000'000};

QuadrotorPath BentPath() {
  std::vector<double> times_s;
  std::vector<FlatOutput> values;
  for (int i = 0; i <= 30; ++i) {
    times_s.push_back(i);
    values.emplace_back(20 * std::cos(0.3 * i), 15 * std::sin(0.4 * i), 20 + 0.2 * i, 0.3 * i);
  }
  Random random(3);
  return QuadrotorPath({MinimumSnapCurve(times_s, values)}, {false, 0.1},
                       WindJitter(WindOptions{}, &random), std::nullopt);
}

/// At one place, turned by yaw.
class StillPath : public FlightPath {
 public:
  explicit StillPath(double duration_s, double yaw = 0)
      : duration_s_(duration_s), pose_(RotationExp({0, 0, yaw}), Eigen::Vector3d(100, 200, 50)) {}
  double duration_s() const override { return duration_s_; }
  BodyState At(double /*time_s*/) const override { return {pose_}; }

 private:
  double duration_s_;
  SE3 pose_;
};

ImuOptions Noiseless() { return {200, 0, 0, 0, 0, 0, 0}; }

BodyState Integrate(const std::vector<SimulatedImuSample>& samples) {
  const Eigen::Vector3d gravity(0, 0, -kGravityMps2);
  BodyState state = samples.front().truth;
  Eigen::Quaterniond rotation = state.world_from_body.rotation();
  Eigen::Vector3d position = state.world_from_body.translation();
  // The bias at the start is known; what it does later is part of the noise.
  const Eigen::Vector3d gyroscope_bias = samples.front().gyroscope_bias;
  const Eigen::Vector3d accelerometer_bias = samples.front().accelerometer_bias;
  for (size_t i = 1; i < samples.size(); ++i) {
    const ImuSample &from = samples[i - 1].measured, &to = samples[i].measured;
    const double h = SecondsBetween(from.time, to.time);
    const Eigen::Vector3d rate = (from.angular_velocity + to.angular_velocity) / 2 - gyroscope_bias;
    const Eigen::Quaterniond next = (rotation * RotationExp(h * rate)).normalized();
    const Eigen::Vector3d acceleration = (rotation * (from.specific_force - accelerometer_bias) +
                                          next * (to.specific_force - accelerometer_bias)) /
                                             2 +
                                         gravity;
    position += h * state.velocity_world + h * h / 2 * acceleration;
    state.velocity_world += h * acceleration;
    rotation = next;
  }
  state.world_from_body = SE3(rotation, position);
  return state;
}

struct DeadReckoning {
  double position_m, velocity_m_s, angle_rad;  ///< Errors at the end.
};

DeadReckoning DeadReckon(const ImuOptions& options, double duration_s) {
  Random random(1);
  const auto samples = SimulateImu(BentPath(), options, duration_s, kStart, &random);
  const BodyState found = Integrate(samples), truth = samples.back().truth;
  const SE3 error = truth.world_from_body.Inverse() * found.world_from_body;
  return {(found.world_from_body.translation() - truth.world_from_body.translation()).norm(),
          (found.velocity_world - truth.velocity_world).norm(), error.Angle()};
}

// The rates and forces are the exact ones, so that all error is that of finite steps.
TEST(Imu, IntegratedWithoutNoiseItFollowsTheTruth) {
  ImuOptions options = Noiseless();
  const DeadReckoning usual = DeadReckon(options, 30);
  options.rate_hz = 3200;
  const DeadReckoning fine = DeadReckon(options, 30);
  EXPECT_LT(fine.position_m, 0.005);
  EXPECT_LT(fine.velocity_m_s, 5e-4);
  EXPECT_LT(fine.angle_rad, 3e-6);
  EXPECT_NEAR(usual.angle_rad / fine.angle_rad, 256, 64);  // second order
}

// Bounds: three standard deviations of integrated noise and bias walks of EuRoC's sensor; position
// and velocity by the bias walk of the accelerometer, which outweighs all else.
TEST(Imu, IntegratedWithNoiseItFollowsTheTruthWithinThat) {
  const ImuOptions options;
  const double t = 20;
  const DeadReckoning error = DeadReckon(options, t);
  const double angle = std::hypot(options.gyroscope_noise_density * std::sqrt(t),
                                  options.gyroscope_random_walk * std::sqrt(t * t * t / 3));
  const double tilt_m =
      kGravityMps2 * options.gyroscope_noise_density * std::sqrt(std::pow(t, 5) / 20);
  EXPECT_LT(error.angle_rad, 3 * std::sqrt(3.0) * angle);
  EXPECT_LT(error.velocity_m_s,
            3 * std::sqrt(3.0) * options.accelerometer_random_walk * std::sqrt(t * t * t / 3));
  EXPECT_LT(
      error.position_m,
      3 * std::sqrt(3.0) *
          std::hypot(options.accelerometer_random_walk * std::sqrt(std::pow(t, 5) / 20), tilt_m));
}

struct Errors {
  double position = 0, velocity = 0, angle = 0;  ///< Root mean square an axis.
};

Errors IntegrationErrors(const FlightPath& path, const ImuOptions& options, double duration_s) {
  constexpr int kFlights = 60;
  Errors sum;
  for (int i = 0; i < kFlights; ++i) {
    Random random(100 + static_cast<uint64_t>(i));
    const auto samples = SimulateImu(path, options, duration_s, kStart, &random);
    const BodyState found = Integrate(samples), truth = samples.back().truth;
    const SE3 error = truth.world_from_body.Inverse() * found.world_from_body;
    sum.position +=
        (found.world_from_body.translation() - truth.world_from_body.translation()).squaredNorm();
    sum.velocity += (found.velocity_world - truth.velocity_world).squaredNorm();
    sum.angle += error.Angle() * error.Angle();
  }
  const auto rms = [](double squares) { return std::sqrt(squares / (3 * kFlights)); };
  return {rms(sum.position), rms(sum.velocity), rms(sum.angle)};
}

// The standard deviation of an estimate of sigma from 60 flights of three axes is about 5 %.
constexpr double kTolerance = 0.2;

TEST(Imu, IntegratedWhiteNoiseOfTheAccelerometerGrowsAsItShould) {
  ImuOptions options = Noiseless();
  options.accelerometer_noise_density = 0.02;
  const double t = 8;
  const Errors errors = IntegrationErrors(BentPath(), options, t);
  EXPECT_NEAR(errors.velocity / (0.02 * std::sqrt(t)), 1, kTolerance);
  EXPECT_NEAR(errors.position / (0.02 * std::sqrt(t * t * t / 3)), 1, kTolerance);
}

// Where the body does not turn, as else the bias of one time undoes that of another.
TEST(Imu, IntegratedRandomWalkOfTheAccelerometerGrowsAsItShould) {
  ImuOptions options = Noiseless();
  options.accelerometer_random_walk = 0.02;
  const double t = 8;
  const Errors errors = IntegrationErrors(StillPath(t), options, t);
  EXPECT_NEAR(errors.velocity / (0.02 * std::sqrt(t * t * t / 3)), 1, kTolerance);
  EXPECT_NEAR(errors.position / (0.02 * std::sqrt(std::pow(t, 5) / 20)), 1, kTolerance);
}

TEST(Imu, IntegratedNoiseOfTheGyroscopeGrowsAsItShould) {
  ImuOptions options = Noiseless();
  options.gyroscope_noise_density = 1e-3;
  EXPECT_NEAR(IntegrationErrors(BentPath(), options, 8).angle / (1e-3 * std::sqrt(8.0)), 1,
              kTolerance);
}

TEST(Imu, NoiseAndBiasAreAsSpecified) {
  ImuOptions options;
  options.gyroscope_noise_density = 2e-3;
  options.gyroscope_random_walk = 1e-3;
  Random random(5);
  const double duration_s = 500;
  const auto samples = SimulateImu(StillPath(duration_s), options, duration_s, kStart, &random);
  double white = 0, walk = 0;
  for (size_t i = 1; i < samples.size(); ++i) {
    const SimulatedImuSample& s = samples[i];
    white += (s.measured.angular_velocity - s.gyroscope_bias).squaredNorm() / 3;
    walk += (s.gyroscope_bias - samples[i - 1].gyroscope_bias).squaredNorm() / 3;
  }
  const auto count = static_cast<double>(samples.size() - 1);
  EXPECT_NEAR(std::sqrt(white / count) / (2e-3 * std::sqrt(200.0)), 1, 0.01);
  EXPECT_NEAR(std::sqrt(walk / duration_s) / 1e-3, 1, 0.01);
}

TEST(Imu, AtRestItFeelsTheGroundPushUpwards) {
  Random random(6);
  const auto samples = SimulateImu(StillPath(1, 2), Noiseless(), 1, kStart, &random);
  EXPECT_LT((samples[7].measured.specific_force - Eigen::Vector3d(0, 0, 9.81)).norm(), 1e-12);
  EXPECT_EQ(samples[7].measured.time.nanoseconds, kStart.nanoseconds + 35'000'000);
}

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
