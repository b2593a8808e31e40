#include "deepuav/io/cameras/xmp_lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "deepuav/io/cameras/found_camera.h"

namespace deepuav {
namespace {

const cv::Size kSize(4864, 3648);
const std::string kDesigned =
    "drone-dji:CalibratedFocalLength=\"3666.666504\" drone-dji:CalibratedOpticalCenterX=\"2432.0\" "
    "drone-dji:CalibratedOpticalCenterY=\"1824.0\" ";
/// As a drone writes it that was measured at the factory; such values are typical of its lens.
const std::string kMeasured =
    "drone-dji:DewarpData=\" 2019-03-13;3660.1,3653.9,-7.5,44.25,-0.2695,0.1157,-0.0001,-0.0003,"
    "-0.0358\"";

/// What the camera sees of a ray, by all of the distortion that is stated.
Eigen::Vector2d Stated(double x, double y) {
  const double r2 = x * x + y * y, p1 = -0.0001, p2 = -0.0003;
  const double radial = 1 + r2 * (-0.2695 + r2 * (0.1157 + r2 * -0.0358));
  return {3660.1 * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + 2431.5 - 7.5,
          3653.9 * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + 1823.5 + 44.25};
}

TEST(XmpLens, ALensThatWasMeasuredComesBeforeThatOfItsDesign) {
  const auto found = CameraFromMetadata(ParseXmpLens(kDesigned + kMeasured), {}, kSize);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->source.text, "XMP measured");
  EXPECT_LT(found->source.focal_sigma, 0.01);
  EXPECT_NEAR(found->camera.pinhole.fx, 3657, 0.1);
  EXPECT_EQ(found->camera.pinhole.fy, found->camera.pinhole.fx);
  for (const double x : {-0.6, -0.3, 0.0, 0.3, 0.6}) {
    for (const double y : {-0.45, 0.0, 0.2, 0.45}) {
      const auto px = found->camera.Distort({x, y, 1});
      ASSERT_TRUE(px);
      EXPECT_LT((*px - Stated(x, y)).norm(), 6) << x << ' ' << y;  // Of 4864.
    }
  }
}

TEST(XmpLens, APhotographReducedSinceHasAShorterLens) {
  const cv::Size half(kSize / 2);
  const auto whole = CameraFromMetadata(ParseXmpLens(kDesigned + kMeasured), {}, kSize);
  const auto reduced = CameraFromMetadata(ParseXmpLens(kDesigned + kMeasured), {}, half);
  ASSERT_TRUE(whole && reduced);
  EXPECT_NEAR(reduced->camera.pinhole.fx, whole->camera.pinhole.fx / 2, 1e-9);
  EXPECT_NEAR(reduced->camera.pinhole.cy, 911.5 + 44.25 / 2, 1e-9);
  EXPECT_NEAR(reduced->camera.distortion[0], whole->camera.distortion[0], 1e-9);
}

TEST(XmpLens, AModelOfMoreTermsIsMetOverTheImage) {
  // 1 + a r^2 over 1 - b r^2 is 1 + (a + b) r^2 near the middle.
  const auto found = CameraFromMetadata(
      ParseXmpLens("<drone-dji:DewarpDataK6>2024-01-01;3000,3000,0,0,-0.1,0,0,0,0,0.05,0,0"
                   "</drone-dji:DewarpDataK6>"),
      {}, {4000, 3000});
  ASSERT_TRUE(found);
  for (const double r : {0.2, 0.5, 0.75}) {
    const auto px = found->camera.Distort({r, 0, 1});
    ASSERT_TRUE(px);
    EXPECT_NEAR(px->x(), 1999.5 + 3000 * r * (1 - 0.1 * r * r) / (1 + 0.05 * r * r), 1) << r;
  }
}

TEST(XmpLens, APictureWhoseDistortionIsUndoneHasNone) {
  const auto found = CameraFromMetadata(
      ParseXmpLens(kDesigned + kMeasured + " drone-dji:DewarpFlag=\"1\""), {}, kSize);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->camera.lens, LensModel::kPinhole);
  EXPECT_EQ(found->source.text, "XMP calibrated");
}

TEST(XmpLens, InMillimetresOfASensorThatExifKnows) {
  const std::string xmp =
      "<Camera:ModelType>perspective</Camera:ModelType><Camera:PrincipalPoint>2.43,1.80"
      "</Camera:PrincipalPoint><Camera:PerspectiveFocalLength>5.43</Camera:PerspectiveFocalLength>"
      "<Camera:PerspectiveFocalLengthUnits>mm</Camera:PerspectiveFocalLengthUnits>"
      "<Camera:PerspectiveDistortion>-0.1,0.15,-0.05,0.0002,0.0007</Camera:PerspectiveDistortion>";
  PhotoExif exif;
  EXPECT_FALSE(CameraFromMetadata(ParseXmpLens(xmp), exif, {1280, 960}));
  exif.sensor_width_mm = 4.8;
  const auto found = CameraFromMetadata(ParseXmpLens(xmp), exif, {1280, 960});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->camera.pinhole.fx, 5.43 / 4.8 * 1280, 1e-9);
  EXPECT_NEAR(found->camera.pinhole.cx, 2.43 / 4.8 * 1280 - 0.5, 1e-9);
  EXPECT_LT(found->camera.distortion[0], 0);
  EXPECT_FALSE(ParseXmpLens("<Camera:ModelType>fisheye</Camera:ModelType>" +
                            xmp.substr(xmp.find("<Camera:PrincipalPoint"))));
}

TEST(XmpLens, WhereExifSaysAnotherLensOrNothingTellsTheSizeItIsTrustedLessOrNot) {
  PhotoExif exif;
  exif.focal_length_35mm = 50;  // For 25 or so.
  const auto other = CameraFromMetadata(ParseXmpLens(kMeasured), exif, kSize);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->source.text, "EXIF 35 mm equivalent");
  const auto alone = CameraFromMetadata(ParseXmpLens(kMeasured), {}, kSize);
  ASSERT_TRUE(alone);
  EXPECT_GT(alone->source.focal_sigma, 0.01);
  EXPECT_NEAR(alone->camera.pinhole.fx, 3657, 0.1);
}

TEST(XmpLens, WhatCannotBeIsNotBelieved) {
  for (const std::string data :
       {"", "2019-03-13;", "2019-03-13;0,0,0,0,0,0,0,0,0", "a;1,2,3",
        "2019-03-13;3660,3653,0,0,-0.26,0.11,0,0,x", "2019-03-13;3660,3653,2000,0,0,0,0,0,0",
        "2019-03-13;3660,0,0,0,0,0,0,0,0", "2019-03-13;1e9,-999992680,0,0,0,0,0,0,0",
        "2019-03-13;3660,3653,0,0,1e10,1e10,0,0,0", "2019-03-13;3660,3653,0,0,-5,0,0,0,0"}) {
    const auto found = CameraFromMetadata(
        ParseXmpLens(kDesigned + "drone-dji:DewarpData=\"" + data + "\""), {}, kSize);
    ASSERT_TRUE(found) << data;
    EXPECT_EQ(found->source.text, "XMP calibrated") << data;
    EXPECT_NEAR(found->camera.pinhole.fx, 3666.67, 0.01) << data;
  }
}

TEST(XmpLens, TheBandOfACameraThatTakesSeveral) {
  EXPECT_EQ(ParseXmpBand("<Camera:BandName>\n <rdf:Seq>\n <rdf:li>NIR</rdf:li></rdf:Seq>"
                         "</Camera:BandName>"),
            "NIR");
  EXPECT_EQ(ParseXmpBand("drone-dji:BandName=\"RedEdge\""), "RedEdge");
  EXPECT_EQ(ParseXmpBand("<Camera:BandName></Camera:BandName>"), "");
  EXPECT_EQ(ParseXmpBand("Camera:BandNames=\"x\""), "");
  EXPECT_EQ(ParseXmpBand("<Camera:BandName>NIR, and pixels without end"), "");
  // All of them: in colour.
  EXPECT_EQ(ParseXmpBand("<Camera:BandName><rdf:Seq><rdf:li>Red</rdf:li><rdf:li>Green</rdf:li>"
                         "<rdf:li>Blue</rdf:li></rdf:Seq></Camera:BandName>"),
            "");
  EXPECT_EQ(ParseXmpBand("Camera:BandName='RGB'"), "");
}

}  // namespace
}  // namespace deepuav
