#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <tuple>

#include "deepuav/geometry/alignment.h"
#include "deepuav/inertial/alignment/inertial_alignment.h"
#include "support/inertial_flight.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

constexpr double kDegree = M_PI / 180;
const SE3 kCamFromImu(RotationExp({1.9, -0.4, 0.3}), {0.1, -0.2, 0.05});
const Sim3 kWorldFromLevel(0.05, RotationExp({0.4, 0.2, -1}), {2, 1, -3});
const Sim3 kLevelFromWorld = kWorldFromLevel.Inverse();
constexpr double kFrom_s = 1, kTo_s = 17, kMiddle_s = 9, kRate_hz = 10;
constexpr double kImuRate_hz = 50;  // as low as sensors go: what is tested takes less time

/// Poses that err by 1 cm and 0.05 degrees, and a sensor as noisy as it states.
struct Flown {
  explicit Flown(uint64_t seed = 6) {
    Random random(seed);
    path = InertialFlight().CameraPath(kFrom_s, kTo_s, kRate_hz, kCamFromImu, kWorldFromLevel);
    for (TimedPose& pose : path) {
      const SE3& at = pose.world_from_cam;
      pose.world_from_cam = {
          at.rotation() * RotationExp(GaussianVector(0.05 * kDegree, &random)),
          at.translation() + kWorldFromLevel.scale() * GaussianVector(0.01, &random)};
    }
    options.stated_noise_factor = 1;
    options.max_clock_offset_s = 0.02;  // where its search begins: less takes less time
    imu.cam_from_imu = kCamFromImu;
    imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
    imu.samples = InertialFlight().Samples(0, kTo_s + 1, kImuRate_hz);
    const double root_hz = std::sqrt(kImuRate_hz);
    for (ImuSample& sample : imu.samples) {
      sample.angular_velocity +=
          GaussianVector(root_hz * imu.noise.gyroscope_noise_density, &random);
      sample.specific_force +=
          GaussianVector(root_hz * imu.noise.accelerometer_noise_density, &random);
    }
  }

  InertialAttempt Align() const { return AlignInertially(path, imu, options); }

  Trajectory path;
  ImuStream imu;
  InertialOptions options;
};

/// What takes a path nearest to that of the flight.
Sim3 NearestTo(const Trajectory& path) {
  std::vector<Eigen::Vector3d> level;
  for (const TimedPose& pose : path) {
    const SE3 level_from_imu = InertialFlight().WorldFromImu(pose.time.seconds());
    level.push_back(level_from_imu * kCamFromImu.InverseTranslation());
  }
  return *Align(Positions(path), level, AlignmentKind::kSimilar);
}

/// As a share.
double ScaleError(const InertialAlignment& found, const Sim3& truth) {
  return found.level_from_world.scale() / truth.scale() - 1;
}

double Tilt(const InertialAlignment& found) {
  const Eigen::Vector3d up_world = kWorldFromLevel.rotation() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d up = found.level_from_world.rotation() * up_world;
  return std::asin(std::min(1.0, up.head<2>().norm()));
}

void ShiftClock(double seconds, Flown* flown) {
  for (ImuSample& sample : flown->imu.samples)
    sample.time.nanoseconds -= std::llround(1e9 * seconds);
}

/// Makes the map larger by as much as this says of each moment.
void Bend(const std::function<double(double)>& growth, Flown* flown) {
  Eigen::Vector3d before = flown->path.front().world_from_cam.translation(), bent = before;
  for (TimedPose& pose : flown->path) {
    const Eigen::Vector3d here = pose.world_from_cam.translation();
    bent += growth(pose.time.seconds()) * (here - before);
    before = here;
    pose.world_from_cam = {pose.world_from_cam.rotation(), bent};
  }
}

void TurnMount(double degrees, Flown* flown) {
  flown->imu.cam_from_imu = {kCamFromImu.rotation() * RotationExp({degrees * kDegree, 0, 0}),
                             kCamFromImu.translation()};
}

/// What does not belong together.
struct Contradiction {
  const char* name;
  void (*make)(Flown*);
};

const Contradiction kContradictions[] = {
    {"clock just out of reach", [](Flown* flown) { ShiftClock(0.03, flown); }},
    {"clock out of reach", [](Flown* flown) { ShiftClock(-0.3, flown); }},
    {"mount off by 8 degrees", [](Flown* flown) { TurnMount(8, flown); }},
};

TEST(InertialAlignmentGuards, WhatContradictsIsRefusedOrAsWrongAsIsSaid) {
  constexpr double kSigmas = 4;
  for (const auto& [name, make] : kContradictions) {
    Flown flown;
    make(&flown);
    const InertialAttempt attempt = flown.Align();
    if (!attempt.found) {
      EXPECT_NE(attempt.reason, "") << name;
      continue;
    }
    const InertialAlignment& found = *attempt.found;
    EXPECT_LT(std::abs(ScaleError(found, kLevelFromWorld)), kSigmas * found.scale_sigma) << name;
    EXPECT_LT(Tilt(found), kSigmas * found.tilt_sigma_rad) << name;
  }
}

TEST(InertialAlignmentGuards, AMapThatGrowsHasTheScaleThatSuitsItAsAWhole) {
  constexpr double kSigmas = 4;
  const auto from_the_middle_on = [](double t) { return t < kMiddle_s ? 1 : 1.3; };
  const auto all_the_time = [](double t) { return 1 + 0.02 * t; };
  for (const std::function<double(double)>& growth :
       {std::function<double(double)>(from_the_middle_on), {all_the_time}}) {
    Flown flown;
    Bend(growth, &flown);
    const InertialAttempt attempt = flown.Align();
    ASSERT_TRUE(attempt.found) << attempt.reason;
    EXPECT_LT(std::abs(ScaleError(*attempt.found, NearestTo(flown.path))),
              kSigmas * attempt.found->scale_sigma);
    EXPECT_GT(std::abs(ScaleError(*attempt.found, kLevelFromWorld)), 0.05) << "it did grow";
  }
}

TEST(InertialAlignmentGuards, ErrorsAreAsLargeAsTheirStandardDeviationsSay) {
  constexpr int kFlights = 8;
  double scale_square = 0, tilt_square = 0;
  for (int i = 0; i < kFlights; ++i) {
    Flown flown(static_cast<uint64_t>(100 + i));
    // No share that noise does not make.
    flown.options.path_scale_sigma = flown.options.sensor_scale_sigma = 0;
    const InertialAttempt attempt = flown.Align();
    ASSERT_TRUE(attempt.found) << attempt.reason;
    const InertialAlignment& found = *attempt.found;
    scale_square += std::pow(ScaleError(found, kLevelFromWorld) / found.scale_sigma, 2) / kFlights;
    tilt_square += std::pow(Tilt(found) / found.tilt_sigma_rad, 2) / kFlights;
  }
  // Eight of them tell their standard deviation to a quarter.
  EXPECT_GT(std::sqrt(scale_square), 0.4);
  EXPECT_LT(std::sqrt(scale_square), 2);
  EXPECT_GT(std::sqrt(tilt_square), 0.4);
  EXPECT_LT(std::sqrt(tilt_square), 2.5) << "of two axes, the less certain one";
}

InertialAttempt AlignWithBias(const Eigen::Vector3d& gyroscope, const Eigen::Vector3d& force) {
  Flown flown;
  for (ImuSample& sample : flown.imu.samples) {
    sample.angular_velocity += gyroscope;
    sample.specific_force += force;
  }
  return flown.Align();
}

TEST(InertialAlignmentGuards, ASensorWithTooLargeABiasIsNotTrusted) {
  const InertialOptions options;
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  const Eigen::Vector3d direction = Eigen::Vector3d(1, -2, 2) / 3;
  const double gyroscope = options.max_gyroscope_bias_rad_s;
  const double force = options.max_accelerometer_bias_m_s2;
  EXPECT_TRUE(AlignWithBias(0.7 * gyroscope * direction, none).found);
  EXPECT_THAT(AlignWithBias(1.3 * gyroscope * direction, none).reason, HasSubstr("gyroscope"));
  EXPECT_TRUE(AlignWithBias(none, 0.6 * force * direction).found);
  EXPECT_FALSE(AlignWithBias(none, 3 * force * direction).found);
}

TEST(InertialAlignmentGuards, EachLimitRefusesWhatIsJustAboveIt) {
  const Flown flown;
  const InertialAttempt attempt = flown.Align();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  const InertialAlignment& found = *attempt.found;
  const std::tuple<double InertialOptions::*, double, std::string> kLimits[] = {
      {&InertialOptions::max_scale_sigma, found.scale_sigma, "scale open"},
      {&InertialOptions::max_tilt_sigma_deg, found.tilt_sigma_rad / kDegree, "level open"},
      {&InertialOptions::max_chi_square, found.chi_square, "times their noise"},
      {&InertialOptions::max_turn_residual_deg, found.turn_residual_rad / kDegree, "turns"}};
  for (const auto& [limit, value, reason] : kLimits) {
    Flown strict = flown, tolerant = flown;
    strict.options.*limit = 0.99 * value;
    tolerant.options.*limit = 1.01 * value;
    EXPECT_THAT(strict.Align().reason, HasSubstr(reason));
    EXPECT_TRUE(tolerant.Align().found) << reason;
  }
}

/// Of a camera at `centre` whose axis is ahead and whose image's upper edge is up.
SE3 Looking(const Eigen::Vector3d& ahead, const Eigen::Vector3d& upper,
            const Eigen::Vector3d& centre) {
  Eigen::Matrix3d world_from_cam;
  world_from_cam << ahead.cross(upper), -upper, ahead;
  return {world_from_cam, centre};
}

TEST(LevelByFirstCamera, IsOfTheImagesUpperEdgeWhereTheCameraLooksStraightDown) {
  const Eigen::Vector3d up = Eigen::Vector3d(1, 2, -3).normalized();
  const Eigen::Vector3d along = up.unitOrthogonal(), centre(4, 5, 6);
  constexpr double kScale = 7;
  for (const double nod_deg : {-60, 0, 50, 80, 90}) {
    const double nod = nod_deg * kDegree;
    const Eigen::Vector3d ahead = std::cos(nod) * along - std::sin(nod) * up;
    const Eigen::Vector3d upper = std::sin(nod) * along + std::cos(nod) * up;
    const SE3 camera = Looking(ahead, upper, centre);
    const Sim3 level = LevelByFirstCamera(camera, up, kScale);
    EXPECT_LT((level.rotation() * up - Eigen::Vector3d::UnitZ()).norm(), 1e-9) << nod_deg;
    EXPECT_LT((level.rotation() * along - Eigen::Vector3d::UnitX()).norm(), 1e-9) << nod_deg;
    EXPECT_LT((level * centre).norm(), 1e-9) << nod_deg;
    EXPECT_EQ(level.scale(), kScale);
  }
}

constexpr double kGround_s = 30;

/// Stands where the flight begins, then flies it, slowly at first.
struct FromTheGround : InertialFlight {
  static double Since(double t) { return std::max(0.0, t - kGround_s); }
  static double Rate(double t) { return 0.5 - 0.5 * std::cos(std::min(M_PI, Since(t))); }
  static double RateSlope(double t) { return Since(t) < M_PI ? 0.5 * std::sin(Since(t)) : 0; }
  /// The moment of the flight that it has come to.
  static double Along(double t) {
    const double since = Since(t);
    return since < M_PI ? 0.5 * (since - std::sin(since)) : since - 0.5 * M_PI;
  }
  Eigen::Vector3d Position(double t) const override { return InertialFlight::Position(Along(t)); }
  Eigen::Vector3d Velocity(double t) const override {
    return Rate(t) * InertialFlight::Velocity(Along(t));
  }
  Eigen::Vector3d Acceleration(double t) const override {
    return Rate(t) * Rate(t) * InertialFlight::Acceleration(Along(t)) +
           RateSlope(t) * InertialFlight::Velocity(Along(t));
  }
  Eigen::Vector3d Turn(double t) const override { return InertialFlight::Turn(Along(t)); }
};

TEST(InertialAlignmentGuards, ALongTimeOnTheGroundDoesNotHideTheFlight) {
  constexpr double kFlight_s = 8;
  // On the ground the same pixels say the same again and again.
  constexpr double kSigmaOnGround_m = 2e-4, kSigmaInAir_m = 0.01;
  const FromTheGround flight;
  Flown flown;
  Random random(7);
  flown.imu.samples = flight.Samples(0, kGround_s + kFlight_s + 1, kImuRate_hz);
  flown.path =
      flight.CameraPath(kFrom_s, kGround_s + kFlight_s, kRate_hz, kCamFromImu, kWorldFromLevel);
  for (TimedPose& pose : flown.path) {
    const double sigma_m = pose.time < AtSeconds(kGround_s) ? kSigmaOnGround_m : kSigmaInAir_m;
    const SE3& at = pose.world_from_cam;
    pose.world_from_cam = {at.rotation(), at.translation() + kWorldFromLevel.scale() *
                                                                 GaussianVector(sigma_m, &random)};
  }
  const InertialAttempt attempt = flown.Align();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_LT(std::abs(ScaleError(*attempt.found, kLevelFromWorld)), 4 * attempt.found->scale_sigma);
}

}  // namespace
}  // namespace deepuav
