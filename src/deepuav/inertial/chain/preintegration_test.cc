#include "deepuav/inertial/chain/preintegration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/inertial_flight.h"
#include "support/numeric_jacobian.h"

namespace deepuav {
namespace {

const ImuNoise kNoise{1e-3, 1e-4, 1e-2, 1e-3};
constexpr double kGap_s = 0.05;

ImuIntegrator Integrator(double rate_hz = 200) {
  return {InertialFlight().Samples(0, 4, rate_hz), kNoise, kGap_s};
}

/// What the flight truly gained between two moments.
Preintegration Truth(double from_s, double to_s) {
  const InertialFlight flight;
  const Eigen::Vector3d gravity = -InertialFlight::kGravity_m_s2 * Eigen::Vector3d::UnitZ();
  const double seconds = to_s - from_s;
  const Eigen::Quaterniond first_from_world = flight.Rotation(from_s).conjugate();
  Preintegration truth;
  truth.rotation = first_from_world * flight.Rotation(to_s);
  truth.velocity_m_s =
      first_from_world * (flight.Velocity(to_s) - flight.Velocity(from_s) - seconds * gravity);
  truth.position_m =
      first_from_world * (flight.Position(to_s) - flight.Position(from_s) -
                          seconds * flight.Velocity(from_s) - 0.5 * seconds * seconds * gravity);
  return truth;
}

Vector9d Difference(const Preintegration& a, const Preintegration& b) {
  Vector9d difference;
  difference.segment<3>(kTurned) = RotationLog(b.rotation.conjugate() * a.rotation);
  difference.segment<3>(kSpeeded) = a.velocity_m_s - b.velocity_m_s;
  difference.segment<3>(kMoved) = a.position_m - b.position_m;
  return difference;
}

TEST(Preintegration, FollowsTheMotion) {
  const auto motion = Integrator().Between(AtSeconds(1), AtSeconds(2.5), {});
  ASSERT_TRUE(motion);
  EXPECT_DOUBLE_EQ(motion->duration_s, 1.5);
  EXPECT_LT(Difference(*motion, Truth(1, 2.5)).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(Preintegration, InterpolatesAtBothEnds) {
  const auto motion = Integrator().Between(AtSeconds(1.0017), AtSeconds(1.4983), {});
  ASSERT_TRUE(motion);
  EXPECT_LT(Difference(*motion, Truth(1.0017, 1.4983)).cwiseAbs().maxCoeff(), 2e-5);
}

TEST(Preintegration, BetweenTwoSamplesToo) {
  const auto motion = Integrator().Between(AtSeconds(1.001), AtSeconds(1.003), {});
  ASSERT_TRUE(motion);
  EXPECT_LT(Difference(*motion, Truth(1.001, 1.003)).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Preintegration, SubtractsBiases) {
  const ImuBias bias{{0.02, -0.03, 0.01}, {0.1, 0.2, -0.3}};
  std::vector<ImuSample> samples = InertialFlight().Samples(0, 4, 200);
  for (ImuSample& sample : samples) {
    sample.angular_velocity += bias.gyroscope_rad_s;
    sample.specific_force += bias.accelerometer_m_s2;
  }
  const auto motion =
      ImuIntegrator(samples, kNoise, kGap_s).Between(AtSeconds(1), AtSeconds(2), bias);
  ASSERT_TRUE(motion);
  EXPECT_LT(Difference(*motion, Truth(1, 2)).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(Preintegration, ItsDerivativesByTheBiasesAreRight) {
  const ImuIntegrator integrator = Integrator(50);
  const ImuBias bias{{0.02, -0.03, 0.01}, {0.1, 0.2, -0.3}};
  const auto at = [&](const ImuBias& other) {
    return *integrator.Between(AtSeconds(1.003), AtSeconds(2.007), other);
  };
  const Preintegration motion = at(bias);
  const Eigen::MatrixXd numeric = NumericJacobian(
      [&](const Eigen::VectorXd& delta) -> Eigen::VectorXd {
        return Difference(
            at({bias.gyroscope_rad_s + delta.head<3>(), bias.accelerometer_m_s2 + delta.tail<3>()}),
            motion);
      },
      6);
  EXPECT_LT((motion.by_bias - numeric).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Preintegration, ItsCovarianceIsThatOfManyNoisyFlights) {
  constexpr int kFlights = 2000;
  constexpr double kRate_hz = 100;
  const std::vector<ImuSample> clean = InertialFlight().Samples(0, 1, kRate_hz);
  const Preintegration exact =
      *ImuIntegrator(clean, kNoise, kGap_s).Between(AtSeconds(0.1), AtSeconds(0.9), {});
  Random random(4);
  Matrix9d seen = Matrix9d::Zero();
  for (int i = 0; i < kFlights; ++i) {
    std::vector<ImuSample> noisy = clean;
    for (ImuSample& sample : noisy) {
      sample.angular_velocity +=
          GaussianVector(kNoise.gyroscope_noise_density * std::sqrt(kRate_hz), &random);
      sample.specific_force +=
          GaussianVector(kNoise.accelerometer_noise_density * std::sqrt(kRate_hz), &random);
    }
    const Vector9d error = Difference(
        *ImuIntegrator(noisy, kNoise, kGap_s).Between(AtSeconds(0.1), AtSeconds(0.9), {}), exact);
    seen += error * error.transpose() / kFlights;
  }
  for (int i = 0; i < 9; ++i)
    EXPECT_NEAR(std::sqrt(seen(i, i) / exact.covariance(i, i)), 1, 0.08) << i;
}

TEST(Preintegration, PartsAddUpToTheWhole) {
  const ImuIntegrator integrator = Integrator();
  const ImuBias bias{{0.02, -0.03, 0.01}, {0.1, 0.2, -0.3}};
  const auto between = [&](double from_s, double to_s) {
    return *integrator.Between(AtSeconds(from_s), AtSeconds(to_s), bias);
  };
  for (const auto& [middle_s, tolerance] : {std::pair(1.5, 1e-12), {1.5023, 1e-6}}) {
    const Preintegration first = between(1, middle_s), last = between(middle_s, 2.2);
    Preintegration both;
    both.rotation = first.rotation * last.rotation;
    both.velocity_m_s = first.velocity_m_s + first.rotation * last.velocity_m_s;
    both.position_m =
        first.position_m + last.duration_s * first.velocity_m_s + first.rotation * last.position_m;
    EXPECT_LT(Difference(both, between(1, 2.2)).cwiseAbs().maxCoeff(), tolerance) << middle_s;
  }
}

TEST(Preintegration, SamplesAsFarApartAsAllowedAreInterpolated) {
  const std::vector<ImuSample> samples = InertialFlight().Samples(0, 4, 1 / kGap_s);
  const auto covers = [&](double max_gap_s) {
    const ImuIntegrator integrator(samples, kNoise, max_gap_s);
    return integrator.Between(AtSeconds(1.01), AtSeconds(2.99), {}).has_value();
  };
  EXPECT_TRUE(covers(kGap_s));
  EXPECT_FALSE(covers(0.99 * kGap_s));
}

TEST(Preintegration, HasNothingBeyondTheSamplesOrAcrossAGap) {
  std::vector<ImuSample> samples = InertialFlight().Samples(0, 4, 200);
  std::erase_if(samples, [](const ImuSample& sample) {
    return sample.time > AtSeconds(2) && sample.time < AtSeconds(2.1);
  });
  const ImuIntegrator integrator(samples, kNoise, kGap_s);
  EXPECT_FALSE(integrator.Between(AtSeconds(-0.1), AtSeconds(1), {}));
  EXPECT_FALSE(integrator.Between(AtSeconds(3), AtSeconds(4.1), {}));
  EXPECT_FALSE(integrator.Between(AtSeconds(1), AtSeconds(1), {}));
  EXPECT_FALSE(integrator.Between(AtSeconds(1.9), AtSeconds(2.2), {}));
  EXPECT_FALSE(integrator.Between(AtSeconds(1.9), AtSeconds(2.05), {}));
  EXPECT_FALSE(integrator.At(AtSeconds(2.05)));
  EXPECT_TRUE(integrator.Between(AtSeconds(1.9), AtSeconds(2), {}));
  EXPECT_TRUE(integrator.Between(AtSeconds(2.1), AtSeconds(2.3), {}));
  EXPECT_FALSE(ImuIntegrator({}, kNoise, kGap_s).Between(AtSeconds(0), AtSeconds(1), {}));
}

TEST(CleanSamples, SortsAndDropsWhatRepeatsOrIsNoNumber) {
  const auto sample = [](double seconds, double x) {
    return ImuSample{AtSeconds(seconds), {x, 0, 0}, {0, 0, 0}};
  };
  const std::vector<ImuSample> clean = CleanSamples(
      {sample(2, 1), sample(1, 2), sample(2, 3), sample(3, std::nan("")), sample(0, 4)});
  ASSERT_EQ(clean.size(), 3U);
  EXPECT_EQ(clean[0].angular_velocity.x(), 4);
  EXPECT_EQ(clean[1].angular_velocity.x(), 2);
  EXPECT_EQ(clean[2].angular_velocity.x(), 1);
}

TEST(Preintegration, HasNothingAcrossAGapThatEndsWhereItDoes) {
  std::vector<ImuSample> samples = InertialFlight().Samples(0, 4, 200);
  std::erase_if(samples, [](const ImuSample& sample) {
    return sample.time > AtSeconds(2) && sample.time < AtSeconds(2.1);
  });
  const ImuIntegrator integrator(samples, kNoise, kGap_s);
  EXPECT_FALSE(integrator.Between(AtSeconds(1.9), AtSeconds(2.1), {}));
  EXPECT_FALSE(integrator.Between(AtSeconds(2), AtSeconds(2.1), {}));
  EXPECT_FALSE(integrator.Covers(AtSeconds(1.9), AtSeconds(2.1)));
}

}  // namespace
}  // namespace deepuav
