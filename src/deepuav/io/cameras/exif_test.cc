#include "deepuav/io/cameras/exif.h"

#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

PhotoExif Parse(const std::string& bytes) {
  return ParseExif({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
}

TEST(Exif, ReadsTimePositionAndLens) {
  const TestExif written{.model = "FC300S",
                         .time = "2018:04:29 12:06:46",
                         .subsecond = "25",
                         .focal_length_mm = 3.61,
                         .focal_length_35mm = 20,
                         .focal_plane_x_px_per_inch = 0,
                         .pixel_x_dimension = 0,
                         .latitude_deg = 28.041253,
                         .longitude_deg = -82.698474,
                         .altitude_m = -5.677};
  for (const std::string& bytes : {JpegPhotograph(64, 48, 1, written),
                                   PngPhotograph(64, 48, 1, written), ExifBlockBytes(written)}) {
    const PhotoExif exif = Parse(bytes);
    ASSERT_TRUE(exif.time && exif.fix && exif.fix->altitude_m);
    EXPECT_EQ(exif.time->nanoseconds, 1525003606250000000);
    EXPECT_NEAR(exif.fix->latitude_deg, 28.041253, 1e-8);
    EXPECT_NEAR(exif.fix->longitude_deg, -82.698474, 1e-8);
    EXPECT_NEAR(*exif.fix->altitude_m, -5.677, 1e-6);
    EXPECT_EQ(exif.camera_model, "FC300S");
    EXPECT_NEAR(exif.focal_length_mm.value_or(0), 3.61, 1e-9);
    EXPECT_EQ(exif.focal_length_35mm, 20);
  }
}

TEST(Exif, SouthAndEastHaveTheirSigns) {
  TestExif written;
  written.latitude_deg = -33.5;
  written.longitude_deg = 151.25;
  const PhotoExif exif = Parse(JpegPhotograph(32, 32, 1, written));
  ASSERT_TRUE(exif.fix);
  EXPECT_NEAR(exif.fix->latitude_deg, -33.5, 1e-8);
  EXPECT_NEAR(exif.fix->longitude_deg, 151.25, 1e-8);
  EXPECT_FALSE(exif.fix->altitude_m);
}

TEST(Exif, WhatCannotBeIsEmpty) {
  TestExif written;
  written.time = "2018:13:29 12:06:46";
  written.latitude_deg = 95;
  written.longitude_deg = 10;
  const PhotoExif exif = Parse(JpegPhotograph(32, 32, 1, written));
  EXPECT_FALSE(exif.time);
  EXPECT_FALSE(exif.fix);
  EXPECT_FALSE(exif.focal_length_mm);

  for (const char* time : {"0000:00:00 00:00:00", "1970:01:01 00:00:00", "2018:02:30 00:00:00",
                           "2018:04:29 25:00:00", "garbage", "2018:04:29 12:06:4x"}) {
    TestExif wrong;
    wrong.time = time;
    EXPECT_FALSE(Parse(JpegPhotograph(32, 32, 1, wrong)).time) << time;
  }
  TestExif unset;  // what cameras write before the first fix
  unset.latitude_deg = 0;
  unset.longitude_deg = 0;
  EXPECT_FALSE(Parse(JpegPhotograph(32, 32, 1, unset)).fix);
  EXPECT_FALSE(Parse(EncodedImage(32, 32, 1)).time);
  EXPECT_FALSE(Parse("").time);
}

TEST(Exif, LessThanAMinuteFromZeroIsNoFix) {
  TestExif leftover;  // 0 degrees, 0 minutes and whatever bytes lay there as seconds
  leftover.latitude_deg = 0.0239 / 3600;
  leftover.longitude_deg = 57.2 / 3600;
  EXPECT_FALSE(Parse(JpegPhotograph(32, 32, 1, leftover)).fix);
  TestExif at_equator;
  at_equator.latitude_deg = 0.001;
  at_equator.longitude_deg = -78.45;
  const PhotoExif exif = Parse(JpegPhotograph(32, 32, 1, at_equator));
  ASSERT_TRUE(exif.fix);
  EXPECT_NEAR(exif.fix->longitude_deg, -78.45, 1e-6);
}

TEST(Exif, MoreThanSixtySecondsAreNoAngle) {
  TestExif written;
  written.latitude_deg = 48;
  written.longitude_deg = 10;
  written.more_longitude_seconds = 611.7;
  EXPECT_FALSE(Parse(JpegPhotograph(32, 32, 1, written)).fix);
}

TEST(Exif, FocalLengthByEveryMeans) {
  TestExif exif{.model = "FC6310 ",
                .time = {},
                .subsecond = {},
                .focal_length_mm = 8.8,
                .focal_length_35mm = 24,
                .focal_plane_x_px_per_inch = 10000,
                .pixel_x_dimension = 5472,
                .latitude_deg = {},
                .longitude_deg = {},
                .altitude_m = {}};
  const auto focal = [&] {
    return FocalLengthPx(Parse(JpegPhotograph(32, 32, 1, exif)), 5472, 3648).value_or(0);
  };
  EXPECT_NEAR(focal(), 24.0 / 36 * 5472, 1e-9);
  exif.focal_length_35mm = 0;
  EXPECT_NEAR(focal(), 8.8 / (5472 / 10000.0 * 25.4) * 5472, 1e-6);
  exif.focal_plane_x_px_per_inch = 0;
  EXPECT_NEAR(focal(), 8.8 / 13.2 * 5472, 1e-6);
  exif.model = "unheard of";
  EXPECT_EQ(focal(), 0);
  exif.model = "FC6310";
  exif.focal_length_mm = 0;
  EXPECT_EQ(focal(), 0);
}

TEST(Exif, TheEquivalentFocalLengthIsThatOfTheSameDiagonal) {
  PhotoExif exif;
  exif.focal_length_35mm = 20;
  const double diagonal_px = 1000, diagonal_mm = std::hypot(36, 24);
  EXPECT_NEAR(FocalLengthPx(exif, 800, 600).value(), 20 * diagonal_px / diagonal_mm, 1e-3);
  EXPECT_NEAR(FocalLengthPx(exif, 600, 800).value(), 20 * diagonal_px / diagonal_mm, 1e-3);
  EXPECT_NEAR(FocalLengthPx(exif, 900, 600).value(), 20 * 900 / 36.0, 1e-9);
  EXPECT_NEAR(FocalLengthPx(exif, 1600, 900).value(), 20 * 1600 / 36.0, 1e-9) << "cut from 3:2";
}

}  // namespace
}  // namespace deepuav
