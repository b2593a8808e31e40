#include "deepuav/inertial/alignment/running_alignment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/inertial_flight.h"

namespace deepuav {
namespace {

const SE3 kCamFromImu(RotationExp({1.9, -0.4, 0.3}), {0.1, -0.2, 0.05});
const Sim3 kWorldFromLevel(0.05, RotationExp({0.4, 0.2, -1}), {2, 1, -3});
constexpr double kEnd_s = 30, kRate_hz = 5;

struct Straight : InertialFlight {
  Eigen::Vector3d Position(double t) const override { return {4 * t, 0, 10}; }
  Eigen::Vector3d Velocity(double) const override { return {4, 0, 0}; }
  Eigen::Vector3d Acceleration(double) const override { return Eigen::Vector3d::Zero(); }
};

ImuStream StreamOf(const InertialFlight& flight, double end_s = kEnd_s) {
  ImuStream imu;
  imu.cam_from_imu = kCamFromImu;
  imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
  imu.samples = flight.Samples(0, end_s + 1, 200);
  return imu;
}

/// What is told along a path, and when.
std::vector<std::pair<double, MetricWorld>> Told(const Trajectory& path, const ImuStream& imu) {
  const ImuWindow window(imu, 0);
  RunningAlignment running(window, {});
  std::vector<std::pair<double, MetricWorld>> told;
  for (const TimedPose& pose : path) {
    if (const auto news = running.Add(pose))
      told.emplace_back(SecondsBetween(AtSeconds(0), pose.time), *news);
  }
  return told;
}

Trajectory PathOf(const InertialFlight& flight, double from_s, double to_s,
                  const Sim3& world_from_level = kWorldFromLevel) {
  return flight.CameraPath(from_s, to_s, kRate_hz, kCamFromImu, world_from_level);
}

TEST(RunningAlignment, TellsScaleAndLevelWithinSecondsAndKeepsToIt) {
  const InertialFlight flight;
  const ImuStream imu = StreamOf(flight);
  const auto told = Told(PathOf(flight, 1, kEnd_s), imu);
  ASSERT_FALSE(told.empty());
  EXPECT_LT(told.front().first, 12);
  EXPECT_LT(told.size(), 4u);
  for (const auto& [t, world] : told) {
    EXPECT_NEAR(world.metric_from_world.scale() * kWorldFromLevel.scale(), 1, 0.02);
    const Eigen::Vector3d up = world.metric_from_world.rotation() *
                               (kWorldFromLevel.rotation() * Eigen::Vector3d::UnitZ());
    EXPECT_LT(up.head<2>().norm(), 0.01);
    // The world's first camera looks nearly straight up.
    const Eigen::Vector3d edge = world.metric_from_world.rotation() * -Eigen::Vector3d::UnitY();
    EXPECT_NEAR(std::atan2(edge.y(), edge.x()), 0, 1e-9);
    EXPECT_EQ(world.metric_from_world.translation(), Eigen::Vector3d::Zero());
  }
}

TEST(RunningAlignment, AContradictionIsTold) {
  const InertialFlight flight;
  const ImuStream imu = StreamOf(flight, 60);
  Trajectory path = PathOf(flight, 1, 15);
  const Sim3 grown(1.3 * kWorldFromLevel.scale(), kWorldFromLevel.rotation(), {0, 0, 0});
  for (const TimedPose& pose : PathOf(flight, 15.2, 60, grown)) path.push_back(pose);
  const auto told = Told(path, imu);
  ASSERT_FALSE(told.empty());
  EXPECT_NEAR(told.front().second.metric_from_world.scale() * kWorldFromLevel.scale(), 1, 0.03);
  EXPECT_NEAR(told.back().second.metric_from_world.scale() * grown.scale(), 1, 0.03);
}

TEST(RunningAlignment, SaysNothingOfAStraightFlight) {
  const Straight flight;
  const ImuStream imu = StreamOf(flight);
  EXPECT_TRUE(Told(PathOf(flight, 1, kEnd_s), imu).empty());
  const ImuWindow window(imu, 0);
  RunningAlignment running(window, {});
  for (const TimedPose& pose : PathOf(flight, 1, 8)) running.Add(pose);
  EXPECT_FALSE(running.refusal().empty());
  running.Restart();
  EXPECT_TRUE(running.refusal().empty());
}

TEST(RunningAlignment, SamplesThatComeInPiecesTellTheSame) {
  constexpr double kAhead_s = 2, kLong_s = 90;
  const InertialFlight flight;
  const ImuStream imu = StreamOf(flight, kLong_s);
  const Trajectory path = PathOf(flight, 1, kLong_s);
  const auto whole = Told(path, imu);
  ASSERT_FALSE(whole.empty());
  ImuStream sensor = imu;
  sensor.samples.clear();
  ImuWindow window(sensor, RunningAlignment::KeepSeconds({}, kAhead_s));
  RunningAlignment running(window, {});
  size_t next = 0, told = 0;
  for (const TimedPose& pose : path) {
    for (;
         next < imu.samples.size() && SecondsBetween(pose.time, imu.samples[next].time) < kAhead_s;
         ++next)
      window.Add(imu.samples[next]);
    const auto news = running.Add(pose);
    if (!news) continue;
    ASSERT_LT(told, whole.size());
    const auto& [t, world] = whole[told++];
    EXPECT_EQ(SecondsBetween(AtSeconds(0), pose.time), t);
    EXPECT_EQ(news->metric_from_world.scale(), world.metric_from_world.scale());
    EXPECT_EQ(news->scale_sigma, world.scale_sigma);
  }
  EXPECT_EQ(told, whole.size());
  EXPECT_LT(window.size(), imu.samples.size() / 2);
}

TEST(RunningAlignment, StartsAnew) {
  const InertialFlight flight;
  const ImuStream imu = StreamOf(flight);
  const ImuWindow window(imu, 0);
  RunningAlignment running(window, {});
  const Trajectory path = PathOf(flight, 1, kEnd_s);
  size_t next = 0;
  while (!running.told() && next < path.size()) running.Add(path[next++]);
  ASSERT_TRUE(running.told());
  running.Restart();
  EXPECT_FALSE(running.told());
  EXPECT_FALSE(running.Add(path[next]));
}

/// Every fourth sample, which takes a quarter of the time.
ImuStream Thinned(ImuStream imu) {
  std::vector<ImuSample> kept;
  for (size_t i = 0; i < imu.samples.size(); i += 4) kept.push_back(imu.samples[i]);
  imu.samples = kept;
  return imu;
}

TEST(RunningAlignment, PosesThatAreNotLaterChangeNothing) {
  const InertialFlight flight;
  const ImuStream imu = Thinned(StreamOf(flight));
  const Trajectory path = PathOf(flight, 1, kEnd_s / 2);
  Trajectory with_late;
  for (const TimedPose& pose : path) {
    with_late.push_back(pose);
    with_late.push_back({pose.time, SE3()});
    with_late.push_back({AtSeconds(0.5), SE3()});  // before all others, where samples are
  }
  const auto told = Told(path, imu), told_with_late = Told(with_late, imu);
  ASSERT_FALSE(told.empty());
  ASSERT_EQ(told_with_late.size(), told.size());
  for (size_t i = 0; i < told.size(); ++i) {
    EXPECT_EQ(told_with_late[i].first, told[i].first);
    EXPECT_EQ(told_with_late[i].second.metric_from_world.scale(),
              told[i].second.metric_from_world.scale());
  }
}

TEST(RunningAlignment, WhatNoiseMakesOfItIsNoFartherOffThanItSays) {
  constexpr double kPositionSigma_m = 0.02, kTurnSigma_rad = 1e-3, kSigmas = 4;
  for (const uint64_t seed : {1, 2}) {
    Random random(seed);
    const InertialFlight flight;
    ImuStream imu = Thinned(StreamOf(flight));
    for (ImuSample& sample : imu.samples) {
      sample.angular_velocity += Eigen::Vector3d(0.01, -0.02, 0.03) + GaussianVector(2e-3, &random);
      sample.specific_force += Eigen::Vector3d(0.06, -0.05, 0.04) + GaussianVector(0.03, &random);
    }
    Trajectory path = PathOf(flight, 1, kEnd_s / 2);
    for (TimedPose& pose : path) {
      const SE3& at = pose.world_from_cam;
      pose.world_from_cam = {
          at.rotation() * RotationExp(GaussianVector(kTurnSigma_rad, &random)),
          at.translation() + kWorldFromLevel.scale() * GaussianVector(kPositionSigma_m, &random)};
    }
    const auto told = Told(path, imu);
    ASSERT_FALSE(told.empty()) << seed;
    for (const auto& [t, world] : told) {
      const double growth = world.metric_from_world.scale() * kWorldFromLevel.scale();
      EXPECT_LT(std::abs(growth - 1), kSigmas * world.scale_sigma) << seed << " at " << t;
      const Eigen::Vector3d up = world.metric_from_world.rotation() *
                                 (kWorldFromLevel.rotation() * Eigen::Vector3d::UnitZ());
      EXPECT_LT(up.head<2>().norm(), kSigmas * world.tilt_sigma_rad) << seed << " at " << t;
    }
  }
}

}  // namespace
}  // namespace deepuav
