#include "deepuav/simulation/flight/wind_jitter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using Eigen::Vector3d;

TEST(BandNoiseTest, VelocityAndAccelerationAreTheDerivatives) {
  Random random(3);
  const WindJitter wind(WindOptions{}, &random);
  constexpr double kStepS = 1e-4;
  for (double t = -3; t < 20; t += 0.83) {
    for (const auto swing : {&WindJitter::Position, &WindJitter::Rotation}) {
      const Swing now = (wind.*swing)(t), before = (wind.*swing)(t - kStepS),
                  after = (wind.*swing)(t + kStepS);
      EXPECT_LT(((after.value - before.value) / (2 * kStepS) - now.velocity).norm(),
                1e-4 * (1 + now.velocity.norm()));
      EXPECT_LT(((after.velocity - before.velocity) / (2 * kStepS) - now.acceleration).norm(),
                1e-4 * (1 + now.acceleration.norm()));
    }
  }
}

TEST(BandNoiseTest, HasNoPowerOutsideItsBandAndAllOfItInside) {
  constexpr double kSigma = 0.3, kSeconds = 60, kStepS = 0.04, kStepHz = 1 / kSeconds;
  Random random(5);
  const BandNoise noise(kSigma, 1, 3, 0, &random);
  std::vector<double> values;
  for (double t = 0; t < kSeconds; t += kStepS) values.push_back(noise.At(t).value.x());
  double inside = 0, outside = 0;
  for (double f = 0.2; f < 6; f += kStepHz) {
    std::complex<double> sum;
    for (size_t i = 0; i < values.size(); ++i) {
      const double turns = f * kStepS * static_cast<double>(i);
      sum += values[i] * std::polar(1.0, -2 * std::numbers::pi * turns);
    }
    const double power = 2 * std::norm(sum / static_cast<double>(values.size()));
    (f > 0.85 && f < 3.15 ? inside : outside) += power;
  }
  EXPECT_NEAR(inside / (kSigma * kSigma), 1, 0.15);
  EXPECT_LT(outside, 0.03 * inside);
}

TEST(BandNoiseTest, ItsAxesKnowNothingOfEachOther) {
  Random random(7);
  const BandNoise noise(1, 0.5, 5, 1, &random);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  constexpr int kSamples = 20'000;
  for (int i = 0; i < kSamples; ++i) {
    const Vector3d value = noise.At(0.037 * i).value;
    covariance += value * value.transpose() / kSamples;
  }
  EXPECT_LT((covariance - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 0.1) << covariance;
}

TEST(BandNoiseTest, OfNoWidthIsASinusoidAndOfNoStrengthIsStill) {
  Random random(9);
  const BandNoise tone(0.5, 2, 2, 2, &random);
  for (double t = 0; t < 3; t += 0.17) {
    EXPECT_LT((tone.At(t).value - tone.At(t + 0.5).value).norm(), 1e-9);
    EXPECT_LT((tone.At(t).value + tone.At(t + 0.25).value).norm(), 1e-9);
  }
  const BandNoise still(0, 1, 6, 2, &random);
  EXPECT_EQ(still.At(4).value, Vector3d::Zero());
  EXPECT_EQ(still.At(4).acceleration, Vector3d::Zero());
}

TEST(WindOptionsTest, BandsTurnedRoundAreRefused) {
  const auto refused = [](WindOptions options) { EXPECT_THROW(options.Check(), Error); };
  WindOptions wind;
  wind.jitter_low_hz = 7;
  refused(wind);
  wind = {};
  wind.gust_high_hz = 0.05;
  refused(wind);
  wind = {};
  wind.gust_low_hz = wind.gust_high_hz;
  EXPECT_NO_THROW(wind.Check());
}

}  // namespace
}  // namespace deepuav
