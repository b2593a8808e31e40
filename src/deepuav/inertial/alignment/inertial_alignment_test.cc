#include "deepuav/inertial/alignment/inertial_alignment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "support/inertial_flight.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

constexpr double kDegree = M_PI / 180;
const SE3 kCamFromImu(RotationExp({1.9, -0.4, 0.3}), {0.1, -0.2, 0.05});
const Sim3 kWorldFromLevel(0.05, RotationExp({0.4, 0.2, -1}), {2, 1, -3});
constexpr double kFrom_s = 1, kTo_s = 21, kRate_hz = 10;

struct StraightFlight : InertialFlight {
  Eigen::Vector3d Position(double t) const override { return {4 * t, 0, 10}; }
  Eigen::Vector3d Velocity(double) const override { return {4, 0, 0}; }
  Eigen::Vector3d Acceleration(double) const override { return Eigen::Vector3d::Zero(); }
  Eigen::Vector3d Turn(double t) const override { return {0.02 * std::sin(t), 0, 0}; }
};

struct Hover : StraightFlight {
  Eigen::Vector3d Position(double) const override { return {0, 0, 10}; }
  Eigen::Vector3d Velocity(double) const override { return Eigen::Vector3d::Zero(); }
};

/// The camera's path with errors of 1 cm and 0.05 degrees, and the samples of a sensor with biases.
struct Flown {
  explicit Flown(const InertialFlight& flight) {
    Random random(6);
    path = flight.CameraPath(kFrom_s, kTo_s, kRate_hz, kCamFromImu, kWorldFromLevel);
    for (TimedPose& pose : path) {
      const SE3& at = pose.world_from_cam;
      pose.world_from_cam = {
          at.rotation() * RotationExp(GaussianVector(0.05 * kDegree, &random)),
          at.translation() + kWorldFromLevel.scale() * GaussianVector(0.01, &random)};
    }
    options.stated_noise_factor = 1;  // Here it is what is stated.
    imu.cam_from_imu = kCamFromImu;
    imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
    imu.samples = flight.Samples(0, kTo_s + 1, 200);
    for (ImuSample& sample : imu.samples) {
      sample.angular_velocity += bias.gyroscope_rad_s + GaussianVector(2.4e-3, &random);
      sample.specific_force += bias.accelerometer_m_s2 + GaussianVector(0.028, &random);
    }
  }

  InertialAttempt Align() const { return AlignInertially(path, imu, options); }

  ImuBias bias{{0.01, -0.02, 0.03}, {0.06, -0.05, 0.04}};
  Trajectory path;
  ImuStream imu;
  InertialOptions options;
};

double ScaleError(const InertialAlignment& found) {
  return found.level_from_world.scale() * kWorldFromLevel.scale() - 1;
}

double Tilt(const InertialAlignment& found) {
  const Eigen::Vector3d up =
      found.level_from_world.rotation() * (kWorldFromLevel.rotation() * Eigen::Vector3d::UnitZ());
  return up.head<2>().norm();
}

TEST(InertialAlignment, FindsScaleLevelAndBiases) {
  const Flown flown{InertialFlight()};
  const InertialAttempt attempt = flown.Align();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  const InertialAlignment& found = *attempt.found;
  EXPECT_NEAR(ScaleError(found), 0, 4e-3);
  EXPECT_LT(Tilt(found), 0.15 * kDegree);
  EXPECT_LT((found.bias.gyroscope_rad_s - flown.bias.gyroscope_rad_s).norm(), 5e-4);
  EXPECT_LT((found.bias.accelerometer_m_s2 - flown.bias.accelerometer_m_s2).norm(), 0.03);
  EXPECT_NEAR(found.clock_offset_s, 0, 5e-4);
  EXPECT_NEAR(found.position_residual_m, 0.01, 0.003);
  EXPECT_LT(found.scale_sigma, 0.01);
  EXPECT_LT(found.chi_square, 1);
}

TEST(InertialAlignment, IsNoSurerOfTheScaleThanItsSensorIs) {
  Flown flown{InertialFlight()};
  constexpr double kMisScaled = 1.008;
  for (ImuSample& sample : flown.imu.samples) sample.specific_force *= kMisScaled;
  const InertialAttempt attempt = flown.Align();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_GT(std::abs(ScaleError(*attempt.found)), 0.004);
  EXPECT_LT(std::abs(ScaleError(*attempt.found)), 2 * attempt.found->scale_sigma);
}

TEST(InertialAlignment, TurnsTellAMountThatIsNotStated) {
  Flown flown{InertialFlight()};
  flown.imu.mount_is_known = false;
  flown.imu.cam_from_imu = {Eigen::Quaterniond::Identity(), kCamFromImu.translation()};
  const InertialAttempt attempt = flown.Align();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  const InertialAlignment& found = *attempt.found;
  const Eigen::Quaterniond& mount = found.cam_from_imu.rotation();
  EXPECT_LT(RotationLog(mount.conjugate() * kCamFromImu.rotation()).norm(), 0.3 * kDegree);
  EXPECT_GT(found.mount_sigma_rad, 0);
  EXPECT_GT(found.tilt_sigma_rad, found.mount_sigma_rad);
  EXPECT_NEAR(ScaleError(found), 0, 6e-3);
  EXPECT_LT(Tilt(found), 0.4 * kDegree);
}

TEST(InertialAlignment, RefusesAMountThatTurnsDoNotTell) {
  Flown flown{StraightFlight()};
  flown.imu.mount_is_known = false;
  const InertialAttempt attempt = flown.Align();
  EXPECT_FALSE(attempt.found);
  EXPECT_THAT(attempt.reason, HasSubstr("how the sensor is mounted"));
}

TEST(InertialAlignment, TheFirstCameraIsAtTheOriginAndLooksAlongX) {
  const Flown flown{InertialFlight()};
  const InertialAttempt attempt = flown.Align();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  const TimedPose first = MoveTrajectory(attempt.found->level_from_world, flown.path).front();
  const Eigen::Vector3d ahead = first.world_from_cam.rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_LT(first.world_from_cam.translation().norm(), 1e-9);
  EXPECT_GT(ahead.x(), 0);
  EXPECT_NEAR(ahead.y(), 0, 1e-9);
}

TEST(InertialAlignment, FindsTheClocksOffset) {
  for (const double offset_s : {-0.043, 0.062}) {
    Flown flown{InertialFlight()};
    for (ImuSample& sample : flown.imu.samples)
      sample.time.nanoseconds -= std::llround(1e9 * offset_s);
    const InertialAttempt attempt = flown.Align();
    ASSERT_TRUE(attempt.found) << attempt.reason;
    EXPECT_NEAR(attempt.found->clock_offset_s, offset_s, 1e-3);
    EXPECT_NEAR(ScaleError(*attempt.found), 0, 5e-3);
  }
}

TEST(InertialAlignment, NoiseNeedNotBeStatedNorTimesGrow) {
  Flown flown{InertialFlight()};
  flown.imu.noise = {};
  std::swap(flown.imu.samples[500], flown.imu.samples[900]);
  flown.imu.samples.push_back(flown.imu.samples[700]);
  flown.path.push_back(flown.path[50]);
  const InertialAttempt attempt = flown.Align();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_NEAR(ScaleError(*attempt.found), 0, 0.01);
}

TEST(InertialAlignment, WrongPosesDoNotMoveIt) {
  Flown flown{InertialFlight()};
  for (size_t i = 5; i < flown.path.size(); i += 20) {
    const SE3& at = flown.path[i].world_from_cam;
    flown.path[i].world_from_cam = {at.rotation(),
                                    at.translation() + Eigen::Vector3d::Constant(0.05)};  // 1.7 m
  }
  const InertialAttempt attempt = flown.Align();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_NEAR(ScaleError(*attempt.found), 0, 0.01);
}

TEST(InertialAlignment, UsesThePartThatHasSamples) {
  Flown flown{InertialFlight()};
  std::erase_if(flown.imu.samples, [](const ImuSample& s) { return s.time < AtSeconds(10); });
  const InertialAttempt attempt = flown.Align();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_NEAR(ScaleError(*attempt.found), 0, 0.01);
  EXPECT_LT(attempt.found->duration_s, 11.5);
}

TEST(InertialAlignment, IsTheSameEachTime) {
  const Flown flown{InertialFlight()};
  const InertialAttempt first = flown.Align(), again = flown.Align();
  ASSERT_TRUE(first.found && again.found);
  EXPECT_EQ(first.found->level_from_world.scale(), again.found->level_from_world.scale());
  EXPECT_EQ(first.found->tilt_sigma_rad, again.found->tilt_sigma_rad);
}

TEST(InertialAlignment, StopsWhenAsked) {
  const Flown flown{InertialFlight()};
  const InertialAttempt attempt =
      AlignInertially(flown.path, flown.imu, flown.options, [] { return true; });
  EXPECT_FALSE(attempt.found);
  EXPECT_THAT(attempt.reason, HasSubstr("stopped"));
}

TEST(InertialAlignment, RefusesFlightsThatDoNotTellTheScale) {
  EXPECT_FALSE(Flown{StraightFlight()}.Align().found);
  EXPECT_FALSE(Flown{Hover()}.Align().found);
}

TEST(InertialAlignment, RefusesTooLittle) {
  Flown flown{InertialFlight()};
  flown.imu.samples.resize(600);
  EXPECT_THAT(flown.Align().reason, HasSubstr("have samples"));
  flown.imu.samples.clear();
  EXPECT_THAT(flown.Align().reason, HasSubstr("have samples"));
  flown = Flown{InertialFlight()};
  flown.path.clear();
  EXPECT_THAT(flown.Align().reason, HasSubstr("have samples"));
  flown.path.push_back({AtSeconds(2), SE3()});
  EXPECT_THAT(flown.Align().reason, HasSubstr("have samples"));
}

/// What a broken sensor makes of a sample.
using Damage = void (*)(ImuSample*);

TEST(InertialAlignment, RefusesSamplesThatDoNotFit) {
  const Damage kDamages[] = {
      [](ImuSample* s) { s->specific_force *= 1.05; },
      [](ImuSample* s) { s->specific_force *= -1; },
      [](ImuSample* s) {  // Mounted upside down.
        s->angular_velocity.tail<2>() *= -1;
        s->specific_force.tail<2>() *= -1;
      },
      [](ImuSample* s) {  // Saturated.
        s->angular_velocity = s->angular_velocity.cwiseMin(0.1).cwiseMax(-0.1);
        s->specific_force = s->specific_force.cwiseMin(9.5).cwiseMax(-9.5);
      },
      [](ImuSample* s) {  // Gone dead.
        if (s->time < AtSeconds(12)) return;
        s->angular_velocity.setZero();
        s->specific_force.setZero();
      },
      [](ImuSample* s) { s->time.nanoseconds += 1'500'000'000; }};  // Of another moment.
  for (size_t i = 0; i < std::size(kDamages); ++i) {
    Flown flown{InertialFlight()};
    for (ImuSample& sample : flown.imu.samples) kDamages[i](&sample);
    const InertialAttempt attempt = flown.Align();
    EXPECT_FALSE(attempt.found) << i;
    EXPECT_NE(attempt.reason, "");
  }
}

}  // namespace
}  // namespace deepuav
