#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "deepuav/simulation/sensors/imu.h"
#include "deepuav/simulation/testing/sensor_paths.h"

namespace deepuav {
namespace {

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

}  // namespace
}  // namespace deepuav
