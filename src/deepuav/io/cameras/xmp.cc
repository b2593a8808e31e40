#include "deepuav/io/cameras/xmp.h"

#include <cmath>

#include "deepuav/io/cameras/exif.h"
#include "deepuav/io/cameras/xmp_fields.h"

namespace deepuav {
namespace {

/// Values of drone-dji:RtkFlag: a position of one receiver alone, one to decimetres while the
/// ambiguities of the carrier's phase are open, one to centimetres once they are fixed.
constexpr double kRtkSingle = 16, kRtkFloat = 34, kRtkFixed = 50;
/// Where the flag says a kind and no standard deviation stands beside it.
constexpr double kFloatSigma_m = 0.5, kFixedSigma_m = 0.02;
constexpr double kVerticalOverHorizontal = 2;
constexpr double kMostSigma_m = 1000;

/// 0 where there is none that can be.
double XmpSigma(std::string_view head, std::string_view name) {
  const double sigma = XmpNumber(head, name).value_or(0);
  return sigma > 0 && sigma < kMostSigma_m ? sigma : 0;
}

Eigen::Vector3d RtkSigma(std::string_view head, double flag) {
  Eigen::Vector3d sigma(XmpSigma(head, "drone-dji:RtkStdLon"),
                        XmpSigma(head, "drone-dji:RtkStdLat"),
                        XmpSigma(head, "drone-dji:RtkStdHgt"));
  if (flag < kRtkFloat || (sigma.array() > 0).all()) return sigma;
  const double usual_m = flag >= kRtkFixed ? kFixedSigma_m : kFloatSigma_m;
  return {usual_m, usual_m, kVerticalOverHorizontal * usual_m};
}

}  // namespace

std::optional<GnssFix> ParseXmpRtkFix(std::string_view head) {
  const double flag = XmpNumber(head, "drone-dji:RtkFlag").value_or(0);
  if (flag < kRtkSingle) return std::nullopt;
  const auto latitude = XmpNumber(head, "drone-dji:GpsLatitude");
  auto longitude = XmpNumber(head, "drone-dji:GpsLongitude");
  if (!longitude) longitude = XmpNumber(head, "drone-dji:GpsLongtitude");  // Sic, by some.
  if (!latitude || !longitude) return std::nullopt;
  GnssFix fix;
  fix.latitude_deg = *latitude;
  fix.longitude_deg = *longitude;
  fix.altitude_m = XmpNumber(head, "drone-dji:AbsoluteAltitude");
  fix.sigma_m = RtkSigma(head, flag);
  return IsPlaceOnEarth(fix) ? std::optional(fix) : std::nullopt;
}

Eigen::Vector3d ParseXmpAccuracy_m(std::string_view head) {
  const double horizontal_m = XmpSigma(head, "Camera:GPSXYAccuracy");
  return {horizontal_m, horizontal_m, XmpSigma(head, "Camera:GPSZAccuracy")};
}

std::optional<Eigen::Quaterniond> ParseXmpAttitude(std::string_view head) {
  const auto yaw = XmpNumber(head, "drone-dji:GimbalYawDegree");
  const auto pitch = XmpNumber(head, "drone-dji:GimbalPitchDegree");
  const auto roll = XmpNumber(head, "drone-dji:GimbalRollDegree");
  if (!yaw || !pitch || !roll || (*yaw == 0 && *pitch == 0 && *roll == 0)) return std::nullopt;
  constexpr double kDegree = M_PI / 180;
  using Turn = Eigen::AngleAxisd;
  const Eigen::Quaterniond ned_from_gimbal = Turn(*yaw * kDegree, Eigen::Vector3d::UnitZ()) *
                                             Turn(*pitch * kDegree, Eigen::Vector3d::UnitY()) *
                                             Turn(*roll * kDegree, Eigen::Vector3d::UnitX());
  Eigen::Matrix3d enu_from_ned, gimbal_from_cam;  // The gimbal's x is ahead, y right, z down.
  enu_from_ned << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  gimbal_from_cam << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return Eigen::Quaterniond(enu_from_ned * ned_from_gimbal.toRotationMatrix() * gimbal_from_cam);
}

}  // namespace deepuav
