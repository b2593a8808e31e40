#include "deepuav/io/geodata/gpmf_file.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/io/testing/gpmf_test_support.h"
#include "deepuav/io/testing/io_test_support.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {
namespace {

class GpmfFileTest : public ::testing::Test {
 protected:
  std::vector<GnssFix> Read(const std::string& bytes) {
    folder_.Write("GOPR0001.MP4", bytes);
    return ReadGpmfFixes(folder_.path() / "GOPR0001.MP4");
  }
  std::vector<ImuSample> ReadImu(const std::string& bytes) {
    folder_.Write("GOPR0001.MP4", bytes);
    return ReadGpmfImu(folder_.path() / "GOPR0001.MP4");
  }
  TemporaryFolder folder_;
};

TEST_F(GpmfFileTest, FixesAreSpreadOverTheirPayload) {
  const auto fixes = Read(
      Mp4WithTrack("gpmd", {GpmfPayload(47.5, -8.25, 500.5, 4), GpmfPayload(47.6, -8.25, 501, 2)}));
  ASSERT_EQ(fixes.size(), 6u);
  EXPECT_NEAR(fixes[1].latitude_deg, 47.50001, 1e-9);
  EXPECT_NEAR(fixes[1].longitude_deg, -8.25, 1e-9);
  EXPECT_NEAR(*fixes[1].altitude_m, 500.5, 1e-9);
  EXPECT_EQ(fixes[1].time.nanoseconds, 250000000);
  EXPECT_EQ(fixes[4].time.nanoseconds, 1000000000);
  EXPECT_EQ(fixes[5].time.nanoseconds, 1500000000);
}

TEST_F(GpmfFileTest, PayloadsWithoutFixAreLeftOut) {
  const auto fixes =
      Read(Mp4WithTrack("gpmd", {GpmfPayload(47.5, 8, 500, 4, 0), GpmfPayload(0, 0, 0, 1),
                                 GpmfPayload(47, 8, 1, 3)}));
  ASSERT_EQ(fixes.size(), 3u);
  EXPECT_EQ(fixes[0].time.nanoseconds, 2000000000);
}

TEST_F(GpmfFileTest, OtherFilesHaveNone) {
  EXPECT_TRUE(Read(Mp4WithTrack("tmcd", {GpmfPayload(47, 8, 1, 3)})).empty());
  EXPECT_TRUE(Read("not a video").empty());
  EXPECT_TRUE(Read("").empty());
  EXPECT_THROW(ReadGpmfFixes(folder_.path() / "absent.mp4"), Error);
}

TEST_F(GpmfFileTest, InertialSamplesAreTheGyroscopesWithForcesInBetween) {
  // A second with four turns and two forces, and one whose last turns have no force after them.
  const auto samples = ReadImu(Mp4WithTrack(
      "gpmd",
      {GpmfImuPayload({{1, 2, 3}, {2, 2, 3}, {3, 2, 3}, {4, 2, 3}}, {{10, 0, -1}, {20, 0, -1}}),
       GpmfImuPayload({{5, 2, 3}, {6, 2, 3}, {7, 2, 3}, {8, 2, 3}}, {{30, 0, -1}})}));
  ASSERT_EQ(samples.size(), 5u);
  EXPECT_EQ(samples[1].time.nanoseconds, 250000000);
  EXPECT_LT((samples[1].angular_velocity - Eigen::Vector3d(2, 2, 3)).norm(), 1e-3);
  EXPECT_LT((samples[0].specific_force - Eigen::Vector3d(10, 0, -1)).norm(), 1e-2);
  EXPECT_LT((samples[1].specific_force - Eigen::Vector3d(15, 0, -1)).norm(), 1e-2);
  EXPECT_LT((samples[3].specific_force - Eigen::Vector3d(25, 0, -1)).norm(), 1e-2);
  EXPECT_EQ(samples[4].time.nanoseconds, 1000000000);
}

TEST_F(GpmfFileTest, TheLastInertialSamplesComeAtTheRateOfTheOthers) {
  const std::vector<std::array<double, 3>> ten(10, {1, 2, 3}), two(2, {1, 2, 3});
  const auto samples =
      ReadImu(Mp4WithTrack("gpmd", {GpmfImuPayload(ten, ten), GpmfImuPayload(two, two)}));
  ASSERT_EQ(samples.size(), 12u);
  EXPECT_EQ(samples[11].time.nanoseconds, 1100000000);
}

TEST_F(GpmfFileTest, OneSensorAloneGivesNoInertialSamples) {
  EXPECT_TRUE(ReadImu(Mp4WithTrack("gpmd", {GpmfImuPayload({{1, 2, 3}}, {})})).empty());
  EXPECT_TRUE(ReadImu(Mp4WithTrack("gpmd", {GpmfImuPayload({}, {{1, 2, 3}})})).empty());
  EXPECT_TRUE(ReadImu(Mp4WithTrack("gpmd", {GpmfPayload(47, 8, 1, 3)})).empty());
  EXPECT_TRUE(ReadImu("not a video").empty());
}

TEST_F(GpmfFileTest, ARealCamerasInertialSamplesShowGravity) {
  const auto shared = SharedFolder();
  if (!shared) GTEST_SKIP() << "no shared data";
  const auto samples = ReadGpmfImu(*shared / "data/karma/karma.mp4");
  ASSERT_GT(samples.size(), 4500u);
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : samples)
    force += sample.specific_force / static_cast<double>(samples.size());
  EXPECT_NEAR(force.norm(), 9.8, 0.3);
  EXPECT_NEAR(SecondsBetween(samples.front().time, samples.back().time), 12, 0.3);
}

TEST_F(GpmfFileTest, ARealDronesTrack) {
  const auto shared = SharedFolder();
  if (!shared) GTEST_SKIP() << "no shared data";
  const auto fixes = ReadGpmfFixes(*shared / "data/karma/karma.mp4");
  ASSERT_GT(fixes.size(), 40u);
  double length_m = 0;
  for (size_t i = 1; i < fixes.size(); ++i) {
    const GeoPoint from{fixes[i - 1].latitude_deg, fixes[i - 1].longitude_deg, 0};
    length_m += LocalFromGeo(from, {fixes[i].latitude_deg, fixes[i].longitude_deg, 0}).norm();
  }
  EXPECT_NEAR(length_m, 81, 8);
}

}  // namespace
}  // namespace deepuav
