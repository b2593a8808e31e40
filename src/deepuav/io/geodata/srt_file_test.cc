#include "deepuav/io/geodata/srt_file.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

std::string Cue(int second, const std::string& text) {
  return fmt::format("{0}\n00:00:{0:02},000 --> 00:00:{0:02},033\n{1}\n\n", second, text);
}

class SrtFileTest : public ::testing::Test {
 protected:
  std::vector<GnssFix> Read(const std::string& text) {
    folder_.Write("DJI_0001.SRT", text);
    return ReadSrtFile(folder_.path() / "DJI_0001.SRT");
  }
  TemporaryFolder folder_;
};

TEST_F(SrtFileTest, BracketsWithinAFont) {
  const auto fixes = Read(
      Cue(1,
          "<font size=\"28\">SrtCnt : 1, DiffTime : 33ms\n2020-08-09 12:53:43,113,241\n"
          "[iso : 100] [shutter : 1/320.0] [fnum : 280] [ev : 0] [ct : 5198] [latitude: "
          "47.397700] [longitude: 8.545600] [altitude: 517.300000] </font>") +
      Cue(2, "<font size=\"28\">[latitude : -47.5] [longtitude : -8.25] [altitude: 518]</font>"));
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(fixes[0].time.nanoseconds, 1000000000);
  EXPECT_EQ(fixes[0].latitude_deg, 47.3977);
  EXPECT_EQ(fixes[0].longitude_deg, 8.5456);
  EXPECT_EQ(fixes[0].altitude_m, 517.3);
  EXPECT_EQ(fixes[1].latitude_deg, -47.5);
  EXPECT_EQ(fixes[1].longitude_deg, -8.25);
}

TEST_F(SrtFileTest, OfTwoAltitudesTheAbsoluteOne) {
  const auto fixes = Read(Cue(0,
                              "[focal_len: 24.00] [latitude: 22.5] [longitude: 113.9] [rel_alt: "
                              "1.300 abs_alt: 345.128] [ct: 5500]"));
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(fixes[0].altitude_m, 345.128);
}

TEST_F(SrtFileTest, GpsBracketsWithLongitudeFirst) {
  const auto fixes =
      Read(Cue(0,
               "HOME(8.5400,47.3900) 2017.08.05 14:11:51\nGPS(8.5456,47.3977,16) BAROMETER:1.5\n"
               "ISO:100 Shutter:60 EV: Fnum:F2.8") +
           Cue(1,
               "F/2.8, SS 206.14, ISO 100, EV 0, GPS (8.5457, 47.3978, 17), D 24.26m, H 6.00m, "
               "H.S 0.00m/s, V.S 0.00m/s"));
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(fixes[0].latitude_deg, 47.3977);
  EXPECT_EQ(fixes[0].longitude_deg, 8.5456);
  EXPECT_EQ(fixes[0].altitude_m, 1.5);
  EXPECT_EQ(fixes[1].longitude_deg, 8.5457);
  EXPECT_EQ(fixes[1].altitude_m, 6);
}

TEST_F(SrtFileTest, MomentsWithoutFixAndRepeatedFixesAreLeftOut) {
  const auto fixes = Read(Cue(0, "[latitude: 0.000000] [longitude: 0.000000]") +
                          Cue(1, "[latitude: 47] [longitude: 8]") +
                          Cue(2, "[latitude: 47] [longitude: 8]") + Cue(3, "[iso: 100]") +
                          Cue(4, "GPS(n/a,n/a,0)") + Cue(5, "[latitude: 47.1] [longitude: 8]"));
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(fixes[1].time.nanoseconds, 5000000000);
  EXPECT_FALSE(fixes[1].altitude_m);
}

TEST_F(SrtFileTest, LinesMayEndAsWindowsEndsThem) {
  const auto fixes = Read(
      "\xEF\xBB\xBF"
      "1\r\n00:01:00.500 --> 00:01:00.533\r\n[latitude: 47] [longitude: 8]\r\n\r\n");
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(fixes[0].time.nanoseconds, 60500000000);
}

TEST_F(SrtFileTest, WhatCannotBeIsRefused) {
  EXPECT_NE(
      ErrorOf([&] { Read(Cue(0, "[latitude: 147] [longitude: 8]")); }).find("SRT:2: latitude"),
      std::string::npos);
  EXPECT_NE(ErrorOf([&] { Read("no subtitles"); }).find("holds no subtitle"), std::string::npos);
}

}  // namespace
}  // namespace deepuav
