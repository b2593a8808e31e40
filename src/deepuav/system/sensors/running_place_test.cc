#include "deepuav/system/sensors/running_place.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/random.h"
#include "deepuav/sensors/geodesy.h"
#include "deepuav/system/testing/placed_flights.h"

namespace deepuav {
namespace {

const GeoPoint kOrigin{47.4, 8.5, 500};
const Eigen::Vector3d kAntenna(0.1, -0.2, 0.05);
const Sim3 kMapFromLocal(0.05, RotationExp({0.3, -1.2, 0.4}), {1, -2, 3});
constexpr double kRate_hz = 5;

class RunningPlaceTest : public testing::Test {
 protected:
  explicit RunningPlaceTest(double sigma_m = 0.5) : sigma_m_(sigma_m) {
    receiver_.antenna_cam_m = kAntenna;
    options_.gnss.correlation_s = 0;
  }

  RunningPlace::Evidence EvidenceOf(const Trajectory& flight) {
    RunningPlace::Evidence evidence;
    evidence.path = MoveTrajectory(kMapFromLocal, flight);
    evidence.origin = kOrigin;
    evidence.camera_world = evidence.path.back().world_from_cam.translation();
    for (const TimedPose& pose : flight) {
      Eigen::Vector3d at = pose.world_from_cam * kAntenna;
      for (double& value : at) value += random_.Gaussian(sigma_m_);
      const GeoPoint point = GeoFromLocal(kOrigin, at);
      evidence.fixes.push_back({pose.time, point.latitude_deg, point.longitude_deg,
                                point.altitude_m, Eigen::Vector3d::Constant(sigma_m_)});
    }
    return evidence;
  }

  /// Of the camera where the flight ends; metres.
  static double Error(const PlacedWorld& place, const Trajectory& flight) {
    const Eigen::Vector3d end = flight.back().world_from_cam.translation();
    return (place.local_from_world * (kMapFromLocal * end) - end).norm();
  }

  double sigma_m_;
  Random random_{5};
  GnssStream receiver_;
  SensorUseOptions options_;
};

TEST_F(RunningPlaceTest, APathOfSomeLengthTellsThePlace) {
  RunningPlace running(receiver_, options_);
  const Trajectory flight = Winding(30, kRate_hz);
  const auto place = running.Find(EvidenceOf(flight));
  ASSERT_TRUE(place) << running.refusal();
  EXPECT_LT(Error(*place, flight), 0.4);
  EXPECT_NEAR(place->local_from_world.scale() * kMapFromLocal.scale(), 1, 0.01);
  EXPECT_LT(place->position_sigma_m, 0.4);
  EXPECT_NEAR(place->fixes, 150, 3);
}

TEST_F(RunningPlaceTest, TheStatedSigmaIsThatOfManyTries) {
  double squares = 0, stated = 0;
  constexpr int kTries = 40;
  for (int i = 0; i < kTries; ++i) {
    RunningPlace running(receiver_, options_);
    const Trajectory flight = Winding(20, kRate_hz);
    const auto place = running.Find(EvidenceOf(flight));
    ASSERT_TRUE(place) << running.refusal();
    const Eigen::Vector3d end = flight.back().world_from_cam.translation();
    squares += (place->local_from_world * (kMapFromLocal * end) - end).head<2>().squaredNorm();
    stated += place->position_sigma_m;
  }
  EXPECT_NEAR(std::sqrt(squares / kTries) / (stated / kTries), 1, 0.35);
}

TEST_F(RunningPlaceTest, WhatLeavesTheOrientationOpenIsRefused) {
  RunningPlace running(receiver_, options_);
  EXPECT_FALSE(running.Find(EvidenceOf(Straight(20, kRate_hz))));
  EXPECT_FALSE(running.has_told());
  EXPECT_NE(running.refusal().find("straight"), std::string::npos) << running.refusal();
}

TEST_F(RunningPlaceTest, ALevelByAnInertialSensorClosesIt) {
  RunningPlace running(receiver_, options_);
  const Trajectory flight = Straight(20, kRate_hz);
  RunningPlace::Evidence evidence = EvidenceOf(flight);
  // Metres and level, but another heading and origin.
  const Sim3 metric_from_local(1, RotationExp({0, 0, 2}), {5, 6, 7});
  evidence.metric = MetricWorld{metric_from_local * kMapFromLocal.Inverse(), 0.01, 0.005};
  const auto place = running.Find(evidence);
  ASSERT_TRUE(place) << running.refusal();
  EXPECT_LT(Error(*place, flight), 0.6);
  const Eigen::Vector3d up =
      place->local_from_world.rotation() * (kMapFromLocal.rotation() * Eigen::Vector3d::UnitZ());
  EXPECT_GT(up.z(), std::cos(0.02));
}

TEST_F(RunningPlaceTest, AnInertialSensorThatTheFixesContradictIsNotBelieved) {
  RunningPlace running(receiver_, options_);
  const Trajectory flight = Winding(30, kRate_hz);
  RunningPlace::Evidence evidence = EvidenceOf(flight);
  evidence.metric = MetricWorld{
      Sim3(1.3, Eigen::Quaterniond::Identity(), {0, 0, 0}) * kMapFromLocal.Inverse(), 0.01, 0.005};
  const auto place = running.Find(evidence);
  ASSERT_TRUE(place) << running.refusal();
  EXPECT_LT(Error(*place, flight), 0.4);
}

TEST_F(RunningPlaceTest, StaysUntilItIsSurerOrContradicted) {
  RunningPlace running(receiver_, options_);
  ASSERT_TRUE(running.Find(EvidenceOf(Winding(20, kRate_hz))));
  EXPECT_FALSE(running.Find(EvidenceOf(Winding(21, kRate_hz)))) << "hardly surer";
  EXPECT_TRUE(running.Find(EvidenceOf(Winding(120, kRate_hz)))) << "much surer";
  RunningPlace::Evidence moved = EvidenceOf(Winding(121, kRate_hz));
  for (GnssFix& fix : moved.fixes) fix.longitude_deg += 1e-4;  // 7.5 m.
  EXPECT_TRUE(running.Find(moved)) << "elsewhere";
}

TEST_F(RunningPlaceTest, NothingIsToldOfNothing) {
  RunningPlace running(receiver_, options_);
  EXPECT_FALSE(running.Find({}));
  RunningPlace::Evidence apart = EvidenceOf(Winding(20, kRate_hz));
  for (GnssFix& fix : apart.fixes) fix.time.nanoseconds += 1'000'000'000'000;
  EXPECT_FALSE(running.Find(apart));
  EXPECT_FALSE(running.refusal().empty());
}

}  // namespace
}  // namespace deepuav
