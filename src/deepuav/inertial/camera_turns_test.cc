#include "deepuav/inertial/camera_turns.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace deepuav {
namespace {

constexpr double kReadoutS = 0.02, kMaxGapS = 0.05;
constexpr int64_t kStepNs = 5'000'000;

Camera RollingCamera() {
  Camera camera;
  camera.readout_s = kReadoutS;
  return camera;
}

Eigen::Vector3d RateAt(double time_s) {
  return {0.5 * std::sin(20 * time_s), 0.2, -0.4 * std::cos(15 * time_s)};
}

ImuStream Stream(int samples) {
  ImuStream imu;
  imu.cam_from_imu = SE3(RotationExp({0.4, -1.2, 0.3}), Eigen::Vector3d(1, 2, 3));
  for (int i = 0; i < samples; ++i)
    imu.samples.push_back(
        {{i * kStepNs}, RateAt(1e-9 * static_cast<double>(i * kStepNs)), Eigen::Vector3d::Zero()});
  return imu;
}

TEST(CameraTurns, AddsUpWhatTheGyroscopeSaysInTheCamerasAxes) {
  const ImuStream imu = Stream(200);
  const CameraTurns turns(imu, kMaxGapS, RollingCamera());
  for (const int64_t time_ns : {20'000'000, 503'400'000, 700'000'001}) {
    Eigen::Vector3d expected = Eigen::Vector3d::Zero();
    constexpr int kParts = 1000;
    for (int i = 0; i < kParts; ++i)
      expected +=
          RateAt(1e-9 * static_cast<double>(time_ns) + kReadoutS * ((i + 0.5) / kParts - 0.5)) *
          kReadoutS / kParts;
    const auto turn = turns.DuringReadout({time_ns});
    ASSERT_TRUE(turn);
    EXPECT_LT((turn->turn_rad - imu.cam_from_imu.rotation() * expected).norm(), 5e-5);
  }
}

TEST(CameraTurns, KnowWhereEachRowLooked) {
  constexpr double kTimeS = 0.3021;
  const ImuStream imu = Stream(200);
  const auto turn = CameraTurns(imu, kMaxGapS, RollingCamera()).DuringReadout({302'100'000});
  ASSERT_TRUE(turn);
  constexpr int kParts = 1000;
  for (const double moment : {-0.5, -0.25, 0.25, 0.5}) {
    Eigen::Vector3d expected = Eigen::Vector3d::Zero();
    for (int i = 0; i < kParts; ++i) {
      const double share = (i + 0.5) / kParts;
      expected += RateAt(kTimeS + share * moment * kReadoutS) * moment * kReadoutS / kParts;
    }
    expected = imu.cam_from_imu.rotation() * expected;
    EXPECT_LT((turn->TurnAt(moment) - expected).norm(), 2e-5) << moment;
    EXPECT_GT((moment * turn->turn_rad - expected).norm(), 1e-4) << "it did not turn steadily";
  }
  EXPECT_TRUE(turn->travel.isZero(0));
}

TEST(CameraTurns, GoOnAsTheyBentWhereSamplesEnd) {
  const ImuStream all = Stream(200);
  ImuStream later = all;
  constexpr int kMissing = 60;  // The next is of the middle row.
  later.samples.erase(later.samples.begin(), later.samples.begin() + kMissing);
  const Timestamp time{kMissing * kStepNs};
  const auto known = CameraTurns(all, kMaxGapS, RollingCamera()).DuringReadout(time);
  const auto told = CameraTurns(later, kMaxGapS, RollingCamera()).DuringReadout(time);
  ASSERT_TRUE(known && told);
  for (const double moment : {-0.5, -0.2, 0.3, 0.5})
    EXPECT_LT((told->TurnAt(moment) - known->TurnAt(moment)).norm(), 5e-5) << moment;
  EXPECT_GT((0.5 * known->turn_rad + known->TurnAt(-0.5)).norm(), 2e-4);
}

TEST(CameraTurns, SaysNothingOfWhatItsSamplesDoNotCover) {
  ImuStream imu = Stream(200);
  imu.samples.erase(imu.samples.begin() + 80, imu.samples.begin() + 120);
  const CameraTurns turns(imu, kMaxGapS, RollingCamera());
  EXPECT_FALSE(turns.DuringReadout({-5'000'000}));
  EXPECT_TRUE(turns.DuringReadout({5'000'000}));
  EXPECT_FALSE(turns.DuringReadout({500'000'000})) << "in the gap";
  EXPECT_TRUE(turns.DuringReadout({990'000'000}));
  EXPECT_FALSE(turns.DuringReadout({1'000'000'000}));
  EXPECT_FALSE(turns.DuringReadout({-1'000'000'000}));
  EXPECT_TRUE(turns.DuringReadout({200'000'000}));
  EXPECT_FALSE(CameraTurns({}, kMaxGapS, RollingCamera()).DuringReadout({0}));
}

TEST(CameraTurns, FromImageToImageAreThoseOfTheCamerasAxes) {
  const ImuStream imu = Stream(200);
  const CameraTurns turns(imu, kMaxGapS, Camera());
  EXPECT_FALSE(turns.DuringReadout({500'000'000})) << "all rows at once";
  Eigen::Quaterniond now_from_before = Eigen::Quaterniond::Identity();
  constexpr double kFromS = 0.2013, kToS = 0.5371;
  constexpr int kParts = 20'000;
  for (int i = 0; i < kParts; ++i) {
    const double part_s = (kToS - kFromS) / kParts;
    const Eigen::Vector3d rate = imu.cam_from_imu.rotation() * RateAt(kFromS + (i + 0.5) * part_s);
    now_from_before = RotationExp(-part_s * rate) * now_from_before;
  }
  const auto turn = turns.Between({201'300'000}, {537'100'000});
  ASSERT_TRUE(turn);
  EXPECT_LT(turn->angularDistance(now_from_before), 2e-4);
  EXPECT_GT(turn->angularDistance(now_from_before.conjugate()), 0.1);
  EXPECT_FALSE(turns.Between({500'000'000}, {500'000'000}));
  EXPECT_FALSE(turns.Between({900'000'000}, {1'000'000'000})) << "the last sample is earlier";
}

TEST(CameraTurns, LeavesOutSamplesThatCannotBe) {
  ImuStream imu = Stream(200);
  const auto turn = CameraTurns(imu, kMaxGapS, RollingCamera()).DuringReadout({500'000'000});
  const ImuSample repeated = imu.samples[98];
  imu.samples.insert(imu.samples.begin() + 101,
                     {repeated.time, {9, 9, 9}, Eigen::Vector3d::Zero()});
  ImuSample broken = imu.samples[110];
  broken.angular_velocity.x() = std::numeric_limits<double>::quiet_NaN();
  imu.samples.push_back(broken);
  const auto cleaned = CameraTurns(imu, kMaxGapS, RollingCamera()).DuringReadout({500'000'000});
  ASSERT_TRUE(turn && cleaned);
  EXPECT_TRUE(cleaned->TurnsAs(*turn));
}

}  // namespace
}  // namespace deepuav
