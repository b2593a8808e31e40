#include "deepuav/inertial/alignment/inertial_start.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/inertial_flight.h"

namespace deepuav {
namespace {

// Far enough from the sensor for its turns to move the camera as much as the flight does.
const SE3 kCamFromImu(RotationExp({1.2, -0.4, 0.3}), {0.7, -0.9, 0.5});
const Sim3 kWorldFromLevel(0.05, RotationExp({0.4, 0.2, -1}), {2, 1, -3});
const ImuBias kBias{{0.01, -0.02, 0.03}, {0.06, -0.05, 0.04}};
constexpr double kSamplesTo_s = 22, kMaxGap_s = 0.05, kRate_hz = 10;

std::vector<ImuSample> BiasedSamples() {
  std::vector<ImuSample> samples = InertialFlight().Samples(0, kSamplesTo_s, 200);
  for (ImuSample& sample : samples) {
    sample.angular_velocity += kBias.gyroscope_rad_s;
    sample.specific_force += kBias.accelerometer_m_s2;
  }
  return samples;
}

InertialProblem ProblemOf(const ImuIntegrator& imu, double from_s, double to_s) {
  InertialProblem problem{};
  problem.imu = &imu;
  problem.cam_from_imu = kCamFromImu;
  problem.path = InertialFlight().CameraPath(from_s, to_s, kRate_hz, kCamFromImu, kWorldFromLevel);
  return problem;
}

TEST(InertialStart, FindsScaleAndLevelOfACameraFarFromTheSensor) {
  const ImuIntegrator imu(BiasedSamples(), {}, kMaxGap_s);
  const auto start = FindInertialStart(ProblemOf(imu, 1, 21));
  ASSERT_TRUE(start);
  EXPECT_NEAR(start->scale * kWorldFromLevel.scale(), 1, 0.01);
  const Eigen::Vector3d down = kWorldFromLevel.rotation() * -Eigen::Vector3d::UnitZ();
  EXPECT_LT((start->down - down).norm(), 0.005);
  EXPECT_LT((start->gyroscope_bias_rad_s - kBias.gyroscope_rad_s).norm(), 1e-4);
  EXPECT_LT((start->accelerometer_bias_m_s2 - kBias.accelerometer_m_s2).norm(), 0.05);
  EXPECT_EQ(start->clock_offset_s, 0);
}

TEST(InertialStart, IsNoneOfAFewSteps) {
  const ImuIntegrator imu(BiasedSamples(), {}, kMaxGap_s);
  EXPECT_FALSE(FindInertialStart(ProblemOf(imu, 1, 4)));
  EXPECT_FALSE(FindInertialStart(ProblemOf(imu, kSamplesTo_s + 1, kSamplesTo_s + 20)));
}

TEST(InertialStart, ItsStatesMoveAsTheSensorDoesNotTheCamera) {
  const ImuIntegrator imu(BiasedSamples(), {}, kMaxGap_s);
  const InertialProblem problem = ProblemOf(imu, 1, 21);
  InertialStart start;
  start.scale = 1 / kWorldFromLevel.scale();
  const std::vector<InertialState> states = StatesOf(problem, start);
  ASSERT_EQ(states.size(), problem.size());
  for (size_t k = 1; k + 1 < states.size(); ++k) {
    const Eigen::Vector3d velocity =
        kWorldFromLevel.rotation() * InertialFlight().Velocity(problem.path[k].time.seconds());
    EXPECT_LT((states[k].velocity_m_s - velocity).norm(), 0.02) << k;
  }
}

/// Poses are linked where this holds of the first and the last second that a clock may mean.
template <typename Holds>
void ExpectLinks(const InertialProblem& problem, const Holds& holds) {
  const double clock_s = problem.options.max_clock_offset_s;
  size_t linked = 0;
  for (size_t k = 0; k + 1 < problem.size(); ++k) {
    const double first_s = problem.path[k].time.seconds(),
                 last_s = problem.path[k + 1].time.seconds();
    const bool expected = holds(first_s - clock_s, last_s + clock_s);
    EXPECT_EQ(problem.linked[k] != 0, expected) << first_s;
    linked += problem.linked[k];
  }
  EXPECT_GT(linked, 0u);
}

TEST(LinkStates, OnlyWhereSamplesLieWhateverTheClockMayBe) {
  constexpr double kHoleFrom_s = 5, kHoleTo_s = 5.23, kRounding_s = 1e-9;
  std::vector<ImuSample> samples = BiasedSamples();
  std::erase_if(samples, [](const ImuSample& sample) {
    return sample.time > AtSeconds(kHoleFrom_s) && sample.time < AtSeconds(kHoleTo_s);
  });
  const ImuIntegrator imu(samples, {}, kMaxGap_s);
  InertialProblem problem = ProblemOf(imu, 0, kSamplesTo_s);
  problem.LinkStates();
  ExpectLinks(problem, [](double first_s, double last_s) {
    const bool meets_hole = last_s > kHoleFrom_s + kRounding_s && first_s < kHoleTo_s - kRounding_s;
    return first_s > -kRounding_s && last_s < kSamplesTo_s + kRounding_s && !meets_hole;
  });
}

TEST(LinkStates, NotWherePosesAreMissingForTooLong) {
  const ImuIntegrator imu(BiasedSamples(), {}, kMaxGap_s);
  InertialProblem problem = ProblemOf(imu, 1, 21);
  std::erase_if(problem.path, [](const TimedPose& pose) {
    const bool is_short_gap = pose.time > AtSeconds(5) && pose.time < AtSeconds(5.9);
    return is_short_gap || (pose.time > AtSeconds(10) && pose.time < AtSeconds(11.2));
  });
  problem.LinkStates();
  ExpectLinks(problem, [](double first_s, double) { return std::abs(first_s - 9.9) > 0.01; });
}

}  // namespace
}  // namespace deepuav
