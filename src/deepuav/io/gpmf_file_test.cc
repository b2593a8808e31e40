#include "deepuav/io/gpmf_file.h"

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
