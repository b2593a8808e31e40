#include "deepuav/inertial/chain/imu_window.h"

#include <gtest/gtest.h>

#include "support/flights.h"

namespace deepuav {
namespace {

ImuSample SampleAt(double t) { return {AtSeconds(t), {t, 0, 0}, {0, 0, 9.8}}; }

TEST(ImuWindow, GivesWhatLiesBetween) {
  ImuStream imu;
  imu.source = "somewhere";
  imu.noise.gyroscope_noise_density = 0.5;
  imu.mount_is_known = false;
  for (double t : {1, 2, 3}) imu.samples.push_back(SampleAt(t));
  ImuWindow window(imu, 100);
  for (double t : {4, 5}) window.Add(SampleAt(t));
  const ImuStream between = window.Between(AtSeconds(2), AtSeconds(5));
  EXPECT_EQ(between.source, "somewhere");
  EXPECT_EQ(between.noise.gyroscope_noise_density, 0.5);
  EXPECT_FALSE(between.mount_is_known);
  ASSERT_EQ(between.samples.size(), 3u);
  EXPECT_EQ(between.samples.front().time, AtSeconds(2));
  EXPECT_EQ(between.samples.back().time, AtSeconds(4));
  EXPECT_TRUE(window.Between(AtSeconds(6), AtSeconds(9)).samples.empty());
}

TEST(ImuWindow, TimesGrow) {
  ImuWindow window({}, 100);
  for (double t : {1.0, 2.0, 2.0, 0.5, 3.0}) window.Add(SampleAt(t));
  EXPECT_EQ(window.size(), 3u);
}

TEST(ImuWindow, ADayIsNoMoreThanItsLatestPart) {
  constexpr double kKeep_s = 30, kDay_s = 86'400, kRate_hz = 50;
  ImuWindow window({}, kKeep_s);
  size_t most = 0;
  for (int i = 0; i < kDay_s * kRate_hz; ++i) {
    window.Add(SampleAt(i / kRate_hz));
    most = std::max(most, window.size());
  }
  EXPECT_LE(most, 1.5 * kKeep_s * kRate_hz + 2);
  const double end_s = kDay_s - 1 / kRate_hz;
  EXPECT_GE(window.Between(AtSeconds(end_s - kKeep_s), AtSeconds(kDay_s)).samples.size(),
            static_cast<size_t>(kKeep_s * kRate_hz));
}

TEST(ImuWindow, OneOfAFarFutureLeavesRoomForThoseAfterIt) {
  ImuWindow window({}, 10);
  for (double t : {1.0, 2.0, 1e6, 3.0, 1e6 + 1}) window.Add(SampleAt(t));
  EXPECT_EQ(window.size(), 2u);
}

}  // namespace
}  // namespace deepuav
