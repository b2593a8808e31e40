#include "deepuav/io/cameras/xmp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace deepuav {
namespace {

/// As a drone with corrections writes it.
std::string Rtk(const std::string& flag) {
  return "<x:xmpmeta><rdf:Description drone-dji:GpsLatitude=\"+47.40123456789\" "
         "drone-dji:GpsLongitude=\"-8.54987654321\" drone-dji:AbsoluteAltitude=\"+512.345\" "
         "drone-dji:RelativeAltitude=\"+60.1\" drone-dji:RtkFlag=\"" +
         flag + "\"";
}
const std::string kStated =
    " drone-dji:RtkStdLon=\"0.01190\" drone-dji:RtkStdLat=\"0.01210\" "
    "drone-dji:RtkStdHgt=\"0.02650\"/>";

TEST(Xmp, APositionWithCorrectionsComesWithItsStandardDeviations) {
  const auto fix = ParseXmpRtkFix(Rtk("50") + kStated);
  ASSERT_TRUE(fix);
  EXPECT_EQ(fix->latitude_deg, 47.40123456789);
  EXPECT_EQ(fix->longitude_deg, -8.54987654321);
  EXPECT_EQ(fix->altitude_m, 512.345);
  EXPECT_EQ(fix->sigma_m, Eigen::Vector3d(0.0119, 0.0121, 0.0265));
}

TEST(Xmp, ElementsAreReadAsAttributesAre) {
  const auto fix = ParseXmpRtkFix(
      "<drone-dji:RtkFlag>50</drone-dji:RtkFlag><drone-dji:GpsLatitude>47.5</drone-dji:GpsLatitude>"
      "<drone-dji:GpsLongtitude>8.5</drone-dji:GpsLongtitude>");
  ASSERT_TRUE(fix);
  EXPECT_EQ(fix->latitude_deg, 47.5);
  EXPECT_EQ(fix->longitude_deg, 8.5);
  EXPECT_FALSE(fix->altitude_m);
}

TEST(Xmp, WhereNoStandardDeviationStandsTheFlagTellsIt) {
  const auto fixed = ParseXmpRtkFix(Rtk("50")), floating = ParseXmpRtkFix(Rtk("34"));
  const auto alone = ParseXmpRtkFix(Rtk("16"));
  ASSERT_TRUE(fixed && floating && alone);
  EXPECT_LT(fixed->sigma_m.maxCoeff(), 0.1);
  EXPECT_GT(floating->sigma_m.x(), 0.1);
  EXPECT_EQ(alone->sigma_m, Eigen::Vector3d::Zero());
}

TEST(Xmp, NothingWithoutCorrectionsOrWhereItCannotBe) {
  EXPECT_FALSE(ParseXmpRtkFix(Rtk("0") + kStated));
  EXPECT_FALSE(ParseXmpRtkFix(""));
  EXPECT_FALSE(ParseXmpRtkFix("drone-dji:RtkFlag=\"50\""));
  EXPECT_FALSE(
      ParseXmpRtkFix("drone-dji:RtkFlag=\"50\" drone-dji:GpsLatitude=\"0.0\" "
                     "drone-dji:GpsLongitude=\"0.0\""));
  EXPECT_FALSE(
      ParseXmpRtkFix("drone-dji:RtkFlag=\"50\" drone-dji:GpsLatitude=\"147\" "
                     "drone-dji:GpsLongitude=\"8\""));
  EXPECT_FALSE(
      ParseXmpRtkFix("drone-dji:RtkFlag=\"50\" drone-dji:GpsLatitude=\"nan\" "
                     "drone-dji:GpsLongitude="));
  for (const std::string value : {"-1", "nan", "1e300", "0", ""}) {
    const auto fix = ParseXmpRtkFix(Rtk("50") + " drone-dji:RtkStdLon=\"" + value + "\"");
    ASSERT_TRUE(fix);
    EXPECT_GT(fix->sigma_m.minCoeff(), 0) << value;
    EXPECT_LT(fix->sigma_m.maxCoeff(), 0.1) << value;
  }
}

TEST(Xmp, TheAccuracyOfThePositionInExif) {
  EXPECT_EQ(ParseXmpAccuracy_m("Camera:GPSXYAccuracy=\"0.03\" Camera:GPSZAccuracy=\"0.05\""),
            Eigen::Vector3d(0.03, 0.03, 0.05));
  EXPECT_EQ(ParseXmpAccuracy_m("Camera:GPSXYAccuracy=\"-3\""), Eigen::Vector3d::Zero());
}

std::string Gimbal(const std::string& yaw, const std::string& pitch, const std::string& roll) {
  return "drone-dji:GimbalRollDegree=\"" + roll + "\" drone-dji:GimbalYawDegree=\"" + yaw +
         "\" drone-dji:GimbalPitchDegree=\"" + pitch + "\" drone-dji:FlightYawDegree=\"+77.0\"";
}

/// Where a camera so turned has east, north and up of an axis of its own.
void ExpectAxis(const std::string& text, const Eigen::Vector3d& axis_cam,
                const Eigen::Vector3d& expected_enu) {
  const auto enu_from_cam = ParseXmpAttitude(text);
  ASSERT_TRUE(enu_from_cam) << text;
  EXPECT_LT((*enu_from_cam * axis_cam - expected_enu).norm(), 1e-12)
      << text << ": " << (*enu_from_cam * axis_cam).transpose();
}

TEST(Xmp, AGimbalsAnglesSayHowTheCameraIsTurned) {
  const Eigen::Vector3d right = Eigen::Vector3d::UnitX(), down = Eigen::Vector3d::UnitY(),
                        ahead = Eigen::Vector3d::UnitZ();
  const double half = std::sqrt(0.5);
  ExpectAxis(Gimbal("+90.00", "+0.00", "+0.00"), ahead, {1, 0, 0});
  ExpectAxis(Gimbal("+90.00", "+0.00", "+0.00"), right, {0, -1, 0});
  ExpectAxis(Gimbal("+90.00", "+0.00", "+0.00"), down, {0, 0, -1});
  ExpectAxis(Gimbal("-90.00", "-90.00", "+0.00"), ahead, {0, 0, -1});
  ExpectAxis(Gimbal("-90.00", "-90.00", "+0.00"), down, {1, 0, 0});  // Its top looks west.
  ExpectAxis(Gimbal("+180.00", "-45.00", "+0.00"), ahead, {0, -half, -half});
  ExpectAxis(Gimbal("+0.01", "+0.00", "+90.00"), right,
             {0, 0, -1});  // Rolled clockwise, as one who looks ahead sees it.
}

TEST(Xmp, NoAnglesWhereOneIsMissingOrAllAreZero) {
  EXPECT_FALSE(ParseXmpAttitude(Gimbal("+0.00", "-0.00", "0")));
  EXPECT_FALSE(ParseXmpAttitude(Gimbal("nan", "-90.0", "0")));
  EXPECT_FALSE(ParseXmpAttitude(Rtk("50") + kStated));
  EXPECT_FALSE(ParseXmpAttitude("drone-dji:GimbalYawDegree=\"90\""));
}

}  // namespace
}  // namespace deepuav
