#include "deepuav/simulation/sensors/imu.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/simulation/flight/quadrotor_path.h"

namespace deepuav {
namespace {

using Eigen::Vector3d;

constexpr Timestamp kStart{1'700'000'000'000'000'000};

/// Round a circle at an even speed, banked to the inside, ahead along the circle.
class BankedCircle : public FlightPath {
 public:
  BankedCircle(double radius_m, double rate_rad_s, double bank_rad)
      : radius_m_(radius_m), rate_rad_s_(rate_rad_s), bank_rad_(bank_rad) {}
  double duration_s() const override { return 1000; }
  BodyState At(double time_s) const override {
    const double angle = rate_rad_s_ * time_s;
    const Vector3d out(std::cos(angle), std::sin(angle), 0), ahead(-out.y(), out.x(), 0);
    const Eigen::Quaterniond level = RotationExp({0, 0, angle + M_PI / 2});
    BodyState state;
    state.world_from_body = SE3(level * RotationExp({-bank_rad_, 0, 0}), radius_m_ * out);
    state.velocity_world = rate_rad_s_ * radius_m_ * ahead;
    state.acceleration_world = -rate_rad_s_ * rate_rad_s_ * radius_m_ * out;
    state.angular_velocity_body =
        state.world_from_body.rotation().conjugate() * Vector3d(0, 0, rate_rad_s_);
    return state;
  }

 private:
  double radius_m_, rate_rad_s_, bank_rad_;
};

ImuOptions Noiseless(double rate_hz = 200) { return {rate_hz, 0, 0, 0, 0, 0, 0}; }

std::vector<SimulatedImuSample> Simulate(const ImuOptions& options, double duration_s,
                                         uint64_t seed, const FlightPath& path) {
  Random random(seed);
  return SimulateImu(path, options, duration_s, kStart, &random);
}

const BankedCircle kStill(0, 0, 0);

TEST(ImuOnACircle, FeelsTheTurnAndThePullToTheInside) {
  constexpr double kRadiusM = 20, kRate = 0.5, kPull = kRate * kRate * kRadiusM;
  for (const auto& sample : Simulate(Noiseless(), 15, 1, BankedCircle(kRadiusM, kRate, 0))) {
    ASSERT_LT((sample.measured.angular_velocity - Vector3d(0, 0, kRate)).norm(), 1e-12);
    ASSERT_LT((sample.measured.specific_force - Vector3d(0, kPull, kGravityMps2)).norm(), 1e-12);
  }
}

TEST(ImuOnACircle, InABalancedTurnFeelsAllAlongItsOwnVertical) {
  constexpr double kRadiusM = 20, kRate = 0.5, kPull = kRate * kRate * kRadiusM;
  const double bank = std::atan2(kPull, kGravityMps2);
  const Vector3d balanced(0, 0, std::hypot(kPull, kGravityMps2));
  for (const auto& sample : Simulate(Noiseless(), 15, 1, BankedCircle(kRadiusM, kRate, bank))) {
    ASSERT_LT((sample.measured.specific_force - balanced).norm(), 1e-12);
    // The nose comes up as well as round.
    const Vector3d turn = kRate * Vector3d(0, -std::sin(bank), std::cos(bank));
    ASSERT_LT((sample.measured.angular_velocity - turn).norm(), 1e-12);
  }
}

TEST(ImuClock, KeepsItsRateWithoutDriftingWhateverTheRate) {
  for (const double rate_hz : {1.0, 200.0, 333.0, 1000.0 / 7}) {
    const auto samples = Simulate(Noiseless(rate_hz), 60, 1, kStill);
    ASSERT_EQ(samples.size(), 1u + static_cast<size_t>(std::floor(60 * rate_hz + 1e-6)));
    for (size_t i = 0; i < samples.size(); ++i) {
      const double seconds = SecondsBetween(kStart, samples[i].measured.time);
      ASSERT_NEAR(seconds, static_cast<double>(i) / rate_hz, 0.6e-9) << rate_hz;
    }
  }
  EXPECT_EQ(Simulate(Noiseless(), 0, 1, kStill).size(), 1u);
}

TEST(ImuNoise, IsWhiteAndOfTheStatedDensityAtEveryRate) {
  ImuOptions options = Noiseless();
  options.accelerometer_noise_density = 2e-3;
  options.gyroscope_noise_density = 3e-4;
  for (const double rate_hz : {50.0, 400.0}) {
    options.rate_hz = rate_hz;
    const auto samples = Simulate(options, 40'000 / rate_hz, 7, kStill);
    const auto count = static_cast<double>(samples.size());
    // Six numbers in units of what their deviation should be: the covariance is the identity, and
    // what follows tells nothing of what was before. Of 40,000 each is known to 0.005.
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero(),
                                lagged = covariance;
    Eigen::Matrix<double, 6, 1> before = Eigen::Matrix<double, 6, 1>::Zero(), now;
    for (const auto& sample : samples) {
      now << sample.measured.angular_velocity / (3e-4 * std::sqrt(rate_hz)),
          (sample.measured.specific_force - Vector3d(0, 0, kGravityMps2)) /
              (2e-3 * std::sqrt(rate_hz));
      covariance += now * now.transpose() / count;
      lagged += now * before.transpose() / count;
      before = now;
    }
    EXPECT_LT((covariance - Eigen::Matrix<double, 6, 6>::Identity()).cwiseAbs().maxCoeff(), 0.03)
        << covariance;
    EXPECT_LT(lagged.cwiseAbs().maxCoeff(), 0.03) << lagged;
  }
}

TEST(ImuBias, WalksAsABrownianMotionFromItsStart) {
  ImuOptions options = Noiseless(50);
  options.gyroscope_start_bias_rad_s = 0.01;
  options.accelerometer_start_bias_m_s2 = 0.2;
  options.gyroscope_random_walk = 1e-3;
  options.accelerometer_random_walk = 0.05;
  constexpr int kFlights = 300;
  constexpr size_t kTen = 500;
  double start = 0, accelerometer_start = 0, first = 0, both = 0, product = 0;
  for (int i = 0; i < kFlights; ++i) {
    const auto samples = Simulate(options, 20, 100 + static_cast<uint64_t>(i), kStill);
    const auto at = [&](size_t k) { return samples[k].accelerometer_bias; };
    start += samples[0].gyroscope_bias.squaredNorm();
    accelerometer_start += at(0).squaredNorm();
    first += (at(kTen) - at(0)).squaredNorm();
    both += (at(2 * kTen) - at(0)).squaredNorm();
    product += (at(kTen) - at(0)).dot(at(2 * kTen) - at(kTen));
    // It is in what was measured.
    ASSERT_LT(
        (samples[kTen].measured.specific_force - Vector3d(0, 0, kGravityMps2) - at(kTen)).norm(),
        1e-12);
  }
  const auto deviation = [](double squares) { return std::sqrt(squares / (3 * kFlights)); };
  // Of 900 axes each deviation is known to 2.4 %.
  EXPECT_NEAR(deviation(start) / 0.01, 1, 0.1);
  EXPECT_NEAR(deviation(accelerometer_start) / 0.2, 1, 0.1);
  EXPECT_NEAR(deviation(first) / (0.05 * std::sqrt(10)), 1, 0.1);
  EXPECT_NEAR(deviation(both) / (0.05 * std::sqrt(20)), 1, 0.1);
  EXPECT_NEAR(product / first, 0, 0.15);
}

TEST(ImuNoise, FollowsFromTheSeed) {
  const auto one = Simulate({}, 1, 5, kStill), again = Simulate({}, 1, 5, kStill),
             other = Simulate({}, 1, 6, kStill);
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].measured.specific_force, again[i].measured.specific_force);
    EXPECT_EQ(one[i].measured.angular_velocity, again[i].measured.angular_velocity);
    EXPECT_NE(one[i].measured.specific_force, other[i].measured.specific_force);
  }
}

}  // namespace
}  // namespace deepuav
