#include "deepuav/sensors/georeference.h"

#include <gtest/gtest.h>

#include "deepuav/base/random.h"
#include "support/flights.h"

namespace deepuav {
namespace {

const Eigen::Vector3d kAntenna(0.1, -0.2, 0.05);
constexpr double kFixRate_hz = 5;
/// What the camera makes of the flight: another scale, another place.
const Sim3 kMapFromLocal(0.05, RotationExp({0.3, -1.2, 0.4}), {1, -2, 3});

/// A flight over some hundred metres, its camera level in the mean.
Trajectory Flight(double duration_s, double size = 10) {
  Trajectory flight = MakeFlight(static_cast<int>(10 * duration_s), 10);
  for (TimedPose& pose : flight) {
    pose.world_from_cam = SE3(pose.world_from_cam.rotation() * RotationExp({-M_PI / 2, 0, 0}),
                              Eigen::Vector3d(size * pose.world_from_cam.translation()));
  }
  return flight;
}

std::vector<LocalFix> FixesOf(const Trajectory& flight, double sigma_m, Random* random) {
  std::vector<LocalFix> fixes;
  for (size_t i = 0; i < flight.size(); i += 2) {
    LocalFix fix{flight[i].time, flight[i].world_from_cam * kAntenna,
                 Eigen::Vector3d::Constant(sigma_m), true};
    for (double& value : fix.position_m) value += random->Gaussian(sigma_m);
    fixes.push_back(fix);
  }
  return fixes;
}

/// The largest distance of the georeferenced path from the true one.
double LargestError(const Georeference& found, const Trajectory& flight) {
  double largest = 0;
  for (const TimedPose& pose : MoveTrajectory(kMapFromLocal, flight)) {
    const auto& truth = flight[static_cast<size_t>(
        std::llround(SecondsBetween(flight.front().time, pose.time) * 10))];
    largest = std::max(largest, (found.local_from_world * pose.world_from_cam.translation() -
                                 truth.world_from_cam.translation())
                                    .norm());
  }
  return largest;
}

class GeoreferenceTest : public ::testing::Test {
 protected:
  GeoreferenceAttempt Find() const {
    return FindGeoreference(MoveTrajectory(kMapFromLocal, flight_), fixes_, kAntenna, clock_,
                            noise_, options_);
  }

  Random random_{3};
  Trajectory flight_ = Flight(60);
  std::vector<LocalFix> fixes_ = FixesOf(flight_, 0.5, &random_);
  ClockPrior clock_;
  GnssNoise noise_;
  GeoreferenceOptions options_;
};

TEST_F(GeoreferenceTest, ExactFixesGiveTheExactPlace) {
  fixes_ = FixesOf(flight_, 1e-9, &random_);
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_LT(LargestError(*attempt.found, flight_), 1e-5);
  EXPECT_NEAR(attempt.found->local_from_world.scale(), 20, 1e-5);
}

TEST_F(GeoreferenceTest, NoiseIsAveraged) {
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_LT(LargestError(*attempt.found, flight_), 0.25);
  EXPECT_EQ(attempt.found->used(), 300);
  EXPECT_NEAR(attempt.found->horizontal_ratio, 1, 0.15);
  EXPECT_NEAR(attempt.found->horizontal_rms_m, 0.5 * std::sqrt(2), 0.1);
}

TEST_F(GeoreferenceTest, OutliersAreLeftOut) {
  for (size_t i = 0; i < fixes_.size(); i += 10) {
    const double angle = random_.Uniform(0, 2 * M_PI);
    fixes_[i].position_m += Eigen::Vector3d(20 * std::cos(angle), 20 * std::sin(angle), 0);
  }
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_LT(LargestError(*attempt.found, flight_), 0.25);
  EXPECT_NEAR(attempt.found->used(), 270, 3);
  EXPECT_TRUE(attempt.found->outlier[0]);
}

TEST_F(GeoreferenceTest, SpoofedFixesAreLeftOut) {
  for (size_t i = 100; i < 100 + 15 * static_cast<size_t>(kFixRate_hz); ++i)
    fixes_[i].position_m += Eigen::Vector3d(30, 0, 0);
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_LT(LargestError(*attempt.found, flight_), 0.25);
}

TEST_F(GeoreferenceTest, ASigmaStatedTooSmallIsNoticed) {
  for (LocalFix& fix : fixes_) fix.sigma_m /= 5;
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_LT(LargestError(*attempt.found, flight_), 0.25);
  EXPECT_NEAR(attempt.found->horizontal_ratio, 5, 0.7);
  EXPECT_GT(attempt.found->used(), 285);
}

TEST_F(GeoreferenceTest, TheCovarianceIsThatOfManyTries) {
  noise_.correlation_s = 0;
  double squares = 0, stated = 0;
  constexpr int kTries = 40;
  for (int i = 0; i < kTries; ++i) {
    fixes_ = FixesOf(flight_, 0.5, &random_);
    const auto attempt = Find();
    ASSERT_TRUE(attempt.found) << attempt.reason;
    squares += std::pow(std::log(attempt.found->local_from_world.scale() / 20), 2) / kTries;
    stated += attempt.found->scale_sigma() / kTries;
  }
  EXPECT_NEAR(std::sqrt(squares) / stated, 1, 0.35);
}

TEST_F(GeoreferenceTest, AClockOffsetIsFoundWhereItIsOpen) {
  for (LocalFix& fix : fixes_) fix.time.nanoseconds -= 700000000;
  clock_.sigma_s = 1;
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_NEAR(attempt.found->clock_offset_s, 0.7, 0.02);
  EXPECT_LT(LargestError(*attempt.found, flight_), 0.3);
}

TEST_F(GeoreferenceTest, AClockOffsetThatIsGivenIsKept) {
  for (LocalFix& fix : fixes_) fix.time.nanoseconds -= 700000000;
  clock_.offset_s = 0.7;
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_NEAR(attempt.found->clock_offset_s, 0.7, 1e-6);
}

TEST_F(GeoreferenceTest, FixesWithoutAltitudeTellALevelFlight) {
  for (TimedPose& pose : flight_) {
    Eigen::Vector3d position = pose.world_from_cam.translation();
    position.z() = 30;
    pose.world_from_cam = SE3(pose.world_from_cam.rotation(), position);
  }
  fixes_ = FixesOf(flight_, 0.5, &random_);
  for (LocalFix& fix : fixes_) {
    fix.position_m.z() = 30;
    fix.sigma_m.z() = 5;
  }
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_LT(LargestError(*attempt.found, flight_), 1);
}

TEST_F(GeoreferenceTest, AHoverIsRefused) {
  flight_ = Flight(60, 0.01);
  fixes_ = FixesOf(flight_, 0.5, &random_);
  const auto attempt = Find();
  EXPECT_FALSE(attempt.found);
  EXPECT_NE(attempt.reason.find("leave the"), std::string::npos) << attempt.reason;
}

TEST_F(GeoreferenceTest, AStraightFlightIsToldByALevelCameraOnly) {
  for (TimedPose& pose : flight_) {
    const double x = 5 * SecondsBetween(flight_.front().time, pose.time);
    pose.world_from_cam = SE3(RotationExp({-M_PI / 2, 0, 0}), Eigen::Vector3d(x, 0, 0));
  }
  // Along the camera's x axis nothing tells the turn about it.
  fixes_ = FixesOf(flight_, 0.5, &random_);
  const auto refused = Find();
  EXPECT_FALSE(refused.found);
  EXPECT_NE(refused.reason.find("orientation"), std::string::npos) << refused.reason;
  for (TimedPose& pose : flight_) {
    pose.world_from_cam = SE3(RotationExp({0, 0, -M_PI / 2}) * RotationExp({-M_PI / 2, 0, 0}),
                              pose.world_from_cam.translation());
  }
  fixes_ = FixesOf(flight_, 0.5, &random_);
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_GT(attempt.found->turn_sigma_rad(), 0.05);
}

TEST_F(GeoreferenceTest, AFlightThereAndBackIsToldByALevelCamera) {
  for (TimedPose& pose : flight_) {
    const double t = SecondsBetween(flight_.front().time, pose.time);
    const bool there = t < 30;
    pose.world_from_cam =
        SE3(RotationExp({0, 0, there ? -M_PI / 2 : M_PI / 2}) * RotationExp({-M_PI / 2, 0, 0}),
            Eigen::Vector3d(5 * (there ? t : 60 - t), 0, 0));
  }
  fixes_ = FixesOf(flight_, 0.5, &random_);
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_NEAR(attempt.found->turn_sigma_rad(), options_.level_sigma_deg * M_PI / 180, 0.02);
  const Eigen::Vector3d up = attempt.found->local_from_world.rotation() *
                             (kMapFromLocal.rotation() * Eigen::Vector3d::UnitZ());
  EXPECT_GT(up.z(), 0.99);
}

TEST_F(GeoreferenceTest, ANearlyStraightFlightComesOutUpright) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    for (TimedPose& pose : flight_) {
      const double x = 4 * SecondsBetween(flight_.front().time, pose.time);
      const Eigen::Vector3d position(x, std::sin(x / 60), 17);
      pose.world_from_cam = SE3(RotationExp({0, 0, 0.7}) * RotationExp({-2.3, 0, 0}), position);
    }
    fixes_ = FixesOf(flight_, 0.3, &random);
    const double y_phase = random.Uniform(0, 2 * M_PI), z_phase = random.Uniform(0, 2 * M_PI);
    for (LocalFix& fix : fixes_) {  // A receiver's errors change slowly.
      const double t = SecondsBetween(flight_.front().time, fix.time);
      fix.position_m +=
          Eigen::Vector3d(0, 0.8 * std::sin(t / 8 + y_phase), 1.5 * std::sin(t / 12 + z_phase));
    }
    const auto attempt = Find();
    ASSERT_TRUE(attempt.found) << attempt.reason;
    const Eigen::Vector3d up = attempt.found->local_from_world.rotation() *
                               (kMapFromLocal.rotation() * Eigen::Vector3d::UnitZ());
    EXPECT_GT(up.z(), 0.9) << seed;
  }
}

/// What the camera makes of the flight where an IMU has given it metres and a level: another
/// heading.
class KnownGeoreferenceTest : public GeoreferenceTest {
 protected:
  KnownGeoreferenceTest() {
    for (TimedPose& pose : flight_) {
      const double x = 4 * SecondsBetween(flight_.front().time, pose.time);
      pose.world_from_cam = SE3(RotationExp({-M_PI / 2, 0, 0}), Eigen::Vector3d(x, 0, 17));
    }
    fixes_ = FixesOf(flight_, 0.5, &random_);
  }
  GeoreferenceAttempt FindKnown(const Sim3& map_from_local, const MetricPrior& known) const {
    return FindGeoreference(MoveTrajectory(map_from_local, flight_), fixes_, kAntenna, clock_,
                            noise_, options_, {.metric = known});
  }

  const Sim3 heading_{1, RotationExp({0, 0, 2}), {5, 6, 7}};
};

TEST_F(KnownGeoreferenceTest, MetresAndLevelTellAStraightFlight) {
  const auto attempt = FindKnown(heading_, {0.003, 0.01});
  ASSERT_TRUE(attempt.found) << attempt.reason;
  const Sim3& local = attempt.found->local_from_world;
  EXPECT_NEAR(local.scale(), 1, 0.004);
  EXPECT_LT((local.rotation() * Eigen::Vector3d::UnitZ()).head<2>().norm(), 0.02);
  EXPECT_LT(attempt.found->scale_sigma(), 0.003);
  EXPECT_LT(attempt.found->turn_sigma_rad(), 0.02);
  EXPECT_EQ(attempt.found->used(), 300);
}

TEST_F(KnownGeoreferenceTest, WhatIsHardlyKnownIsToldByTheFixes) {
  flight_ = Flight(60);
  fixes_ = FixesOf(flight_, 0.5, &random_);
  const Sim3 wrong(1.1, RotationExp({0.1, 0, 0}), {0, 0, 0});
  const auto attempt = FindKnown(wrong * heading_, {1, 1});
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_NEAR(attempt.found->local_from_world.scale(), 1 / 1.1, 0.02);
}

TEST_F(GeoreferenceTest, FewFixesAreRefused) {
  fixes_.resize(4);
  const auto attempt = Find();
  EXPECT_FALSE(attempt.found);
  EXPECT_NE(attempt.reason.find("expected at least 5"), std::string::npos) << attempt.reason;
}

TEST_F(GeoreferenceTest, ErrorsThatLastAreWorthFewerFixes) {
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_NEAR(attempt.found->fixes_per_independent, 300 / 1.5, 2);
  EXPECT_NEAR(attempt.found->IndependentSigma(0).x(), 0.5 * std::sqrt(200), 1.5);
}

TEST_F(GeoreferenceTest, ErrorsOfFixesByTheCarriersPhaseDoNotLast) {
  fixes_ = FixesOf(flight_, 0.02, &random_);
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_TRUE(attempt.found->by_carrier);
  EXPECT_EQ(attempt.found->fixes_per_independent, 1);
  for (LocalFix& fix : fixes_) fix.sigma_is_stated = false;  // By the options alone.
  const auto unstated = Find();
  ASSERT_TRUE(unstated.found) << unstated.reason;
  EXPECT_GT(unstated.found->fixes_per_independent, 100);
}

}  // namespace
}  // namespace deepuav
