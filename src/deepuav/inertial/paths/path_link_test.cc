#include "deepuav/inertial/paths/path_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "support/inertial_flight.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

const SE3 kCamFromImu(RotationExp({1.9, -0.4, 0.3}), {0.1, -0.2, 0.05});
const Sim3 kPathFromLevel(0.05, RotationExp({0.4, 0.2, -1}), {2, 1, -3});
const Sim3 kOtherLevel(1, RotationExp({0, 0, 0.7}), {20, -3, 4});
constexpr double kBlind_s = 10, kSees_s = 12;
const ImuBias kBias{{0.01, -0.02, 0.03}, {0.06, -0.05, 0.04}};

struct Hover : InertialFlight {
  Eigen::Vector3d Position(double) const override { return {0, 0, 10}; }
  Eigen::Vector3d Velocity(double) const override { return Eigen::Vector3d::Zero(); }
  Eigen::Vector3d Acceleration(double) const override { return Eigen::Vector3d::Zero(); }
};

MotionState StateOf(const InertialFlight& flight, double t) {
  return {AtSeconds(t), flight.WorldFromImu(t), flight.Velocity(t), kBias};
}

MotionState In(const Sim3& new_from_level, MotionState state) {
  state.world_from_imu = {new_from_level.rotation() * state.world_from_imu.rotation(),
                          new_from_level * state.world_from_imu.translation()};
  state.velocity_m_s = new_from_level.rotation() * state.velocity_m_s;
  return state;
}

/// A sensor's samples from 0 to 20 s, with a bias.
struct Flown {
  explicit Flown(const InertialFlight& flight) : imu(BiasedSamples(flight), {}, 0.05) {}

  static std::vector<ImuSample> BiasedSamples(const InertialFlight& flight) {
    std::vector<ImuSample> samples = flight.Samples(0, 20, 200);
    for (ImuSample& sample : samples) {
      sample.angular_velocity += kBias.gyroscope_rad_s;
      sample.specific_force += kBias.accelerometer_m_s2;
    }
    return samples;
  }

  DeadReckoning Reckoning(double clock_offset_s = 0) const {
    return {imu, clock_offset_s, InertialFlight::kGravity_m_s2};
  }

  const ImuIntegrator imu;
};

void ExpectNear(const MotionState& state, const MotionState& truth) {
  EXPECT_EQ(state.time, truth.time);
  EXPECT_LT((state.world_from_imu.translation() - truth.world_from_imu.translation()).norm(), 2e-3);
  EXPECT_LT(state.world_from_imu.rotation().angularDistance(truth.world_from_imu.rotation()), 1e-4);
  EXPECT_LT((state.velocity_m_s - truth.velocity_m_s).norm(), 2e-3);
}

TEST(DeadReckoning, LeadsOnwardsAndBack) {
  const InertialFlight flight;
  const Flown flown(flight);
  const DeadReckoning reckoning = flown.Reckoning();
  const MotionState early = StateOf(flight, kBlind_s), late = StateOf(flight, kSees_s);
  const auto onwards = reckoning.At(late.time, early), back = reckoning.At(early.time, late);
  ASSERT_TRUE(onwards && back);
  ExpectNear(*onwards, late);
  ExpectNear(*back, early);
  ExpectNear(*reckoning.At(early.time, early), early);
}

TEST(DeadReckoning, HeedsTheClock) {
  const InertialFlight flight;
  const Flown flown(flight);
  // What the samples call 10 s the images call 10.5.
  const DeadReckoning reckoning = flown.Reckoning(0.5);
  MotionState early = StateOf(flight, kBlind_s), late = StateOf(flight, kSees_s);
  early.time = AtSeconds(kBlind_s + 0.5), late.time = AtSeconds(kSees_s + 0.5);
  const auto onwards = reckoning.At(late.time, early);
  ASSERT_TRUE(onwards);
  ExpectNear(*onwards, late);
}

TEST(DeadReckoning, NeedsSamples) {
  const InertialFlight flight;
  const Flown flown(flight);
  EXPECT_FALSE(flown.Reckoning().At(AtSeconds(25), StateOf(flight, kBlind_s)));
  EXPECT_FALSE(flown.Reckoning().At(AtSeconds(-1), StateOf(flight, kBlind_s)));
}

TEST(PathLink, MotionsTellHeadingAndPlace) {
  const InertialFlight flight;
  const Flown flown(flight);
  const MotionState known = StateOf(flight, kBlind_s);
  const MotionState there = In(kOtherLevel, StateOf(flight, kSees_s));
  const LinkAttempt link = LinkMotions(known, there, flown.Reckoning(), {});
  ASSERT_TRUE(link.world_from_path) << link.reason;
  EXPECT_EQ(link.world_from_path->scale(), 1);
  const Sim3 expected = kOtherLevel.Inverse();
  EXPECT_LT(link.world_from_path->rotation().angularDistance(expected.rotation()), 1e-4);
  EXPECT_LT((link.world_from_path->translation() - expected.translation()).norm(), 5e-3);
}

TEST(PathLink, MotionsThatContradictAreRefused) {
  const InertialFlight flight;
  const Flown flown(flight);
  const MotionState known = StateOf(flight, kBlind_s);
  MotionState there = StateOf(flight, kSees_s);
  there.velocity_m_s.x() += 1;
  EXPECT_THAT(LinkMotions(known, there, flown.Reckoning(), {}).reason, HasSubstr("velocity"));
  there = In(Sim3(SE3(RotationExp({0.1, 0, 0}), {0, 0, 0})), StateOf(flight, kSees_s));
  EXPECT_THAT(LinkMotions(known, there, flown.Reckoning(), {}).reason, HasSubstr("level"));
  there.time = AtSeconds(30);
  EXPECT_THAT(LinkMotions(known, there, flown.Reckoning(), {}).reason, HasSubstr("samples"));
}

/// The path of a map that starts after, or ends before, the camera was blind.
Trajectory PathFrom(const InertialFlight& flight, double from_s, double to_s) {
  return flight.CameraPath(from_s, to_s, 10, kCamFromImu, kPathFromLevel);
}

TEST(PathLink, APathOfNoScaleIsLinkedOnEitherSide) {
  const InertialFlight flight;
  const Flown flown(flight);
  const Sim3 expected = kPathFromLevel.Inverse();
  const std::pair<double, Trajectory> kCases[] = {
      {kBlind_s, PathFrom(flight, kSees_s, kSees_s + 1)},
      {kSees_s, PathFrom(flight, kBlind_s - 6, kBlind_s)}};
  for (const auto& [known_s, path] : kCases) {
    const LinkAttempt link =
        LinkPath(StateOf(flight, known_s), path, kCamFromImu, flown.Reckoning(), {});
    ASSERT_TRUE(link.world_from_path) << link.reason;
    EXPECT_NEAR(link.world_from_path->scale(), expected.scale(), 2e-3 * expected.scale());
    EXPECT_LT(link.world_from_path->rotation().angularDistance(expected.rotation()), 1e-3);
    const Eigen::Vector3d first = path.front().world_from_cam.translation();
    EXPECT_LT((*link.world_from_path * first - expected * first).norm(), 0.02);
  }
}

TEST(PathLink, APathThatContradictsIsRefused) {
  const InertialFlight flight;
  const Flown flown(flight);
  const MotionState known = StateOf(flight, kBlind_s);
  const auto reason = [&](const Trajectory& path) {
    return LinkPath(known, path, kCamFromImu, flown.Reckoning(), {}).reason;
  };
  Trajectory path = PathFrom(flight, kSees_s, kSees_s + 3);
  for (TimedPose& pose : path) {  // Of another flight: it turns otherwise, or goes elsewhere.
    pose.world_from_cam = {
        pose.world_from_cam.rotation() *
            RotationExp({0.2 * SecondsBetween(path.front().time, pose.time), 0, 0}),
        pose.world_from_cam.translation()};
  }
  EXPECT_THAT(reason(path), HasSubstr("turns"));
  path = PathFrom(flight, kSees_s, kSees_s + 3);
  for (TimedPose& pose : path) {
    Eigen::Vector3d elsewhere = pose.world_from_cam.translation();
    elsewhere.y() += 0.02 * std::pow(SecondsBetween(path.front().time, pose.time), 2);
    pose.world_from_cam = {pose.world_from_cam.rotation(), elsewhere};
  }
  EXPECT_THAT(reason(path), HasSubstr("miss the path"));
  EXPECT_THAT(reason(PathFrom(flight, kSees_s, kSees_s + 0.25)), HasSubstr("poses"));
  EXPECT_THAT(reason({}), HasSubstr("poses"));
}

TEST(PathLink, APathThatGoesTheOtherWayHasNoScale) {
  const InertialFlight flight;
  const Flown flown(flight);
  Trajectory path = PathFrom(flight, kSees_s, kSees_s + 3);
  const Eigen::Vector3d first = path.front().world_from_cam.translation();
  for (TimedPose& pose : path) {
    pose.world_from_cam = {pose.world_from_cam.rotation(),
                           2 * first - pose.world_from_cam.translation()};
  }
  const LinkAttempt link =
      LinkPath(StateOf(flight, kBlind_s), path, kCamFromImu, flown.Reckoning(), {});
  EXPECT_FALSE(link.world_from_path);
  EXPECT_NE(link.reason, "");
}

TEST(PathLink, AHoverTellsNoScale) {
  const Hover flight;
  const Flown flown(flight);
  const LinkAttempt link =
      LinkPath(StateOf(flight, kBlind_s), PathFrom(flight, kSees_s, kSees_s + 3), kCamFromImu,
               flown.Reckoning(), {});
  EXPECT_THAT(link.reason, HasSubstr("too little"));
}

}  // namespace
}  // namespace deepuav
