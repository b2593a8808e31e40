#include "deepuav/sensors/geodesy.h"

#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <algorithm>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

GeographicLib::LocalCartesian LocalAbout(const GeoPoint& origin) {
  return {origin.latitude_deg, origin.longitude_deg, origin.altitude_m};
}

Eigen::Vector3d Forward(const GeographicLib::LocalCartesian& local, const GeoPoint& point) {
  Eigen::Vector3d position_m;
  local.Forward(point.latitude_deg, point.longitude_deg, point.altitude_m, position_m.x(),
                position_m.y(), position_m.z());
  return position_m;
}

}  // namespace

GeoPoint PlaceOf(const GnssFix& fix) {
  return {fix.latitude_deg, fix.longitude_deg, fix.altitude_m.value_or(0)};
}

Eigen::Vector3d LocalFromGeo(const GeoPoint& origin, const GeoPoint& point) {
  return Forward(LocalAbout(origin), point);
}

GeoPoint GeoFromLocal(const GeoPoint& origin, const Eigen::Vector3d& position_m) {
  GeoPoint point;
  LocalAbout(origin).Reverse(position_m.x(), position_m.y(), position_m.z(), point.latitude_deg,
                             point.longitude_deg, point.altitude_m);
  return point;
}

UtmZone UtmZoneOf(const GeoPoint& point) {
  const int number = GeographicLib::UTMUPS::StandardZone(point.latitude_deg, point.longitude_deg);
  if (number < GeographicLib::UTMUPS::MINUTMZONE) {
    throw Error("latitude {}: expected -80 to 84 degrees, where UTM has zones", point.latitude_deg);
  }
  return {number, point.latitude_deg >= 0};
}

Eigen::Vector3d UtmFromGeo(const UtmZone& zone, const GeoPoint& point) {
  constexpr double kSouthernNorthing_m = 1e7;  // Of the equator, in a southern zone.
  int number = 0;
  bool is_north = true;
  double easting_m = 0, northing_m = 0;
  GeographicLib::UTMUPS::Forward(point.latitude_deg, point.longitude_deg, number, is_north,
                                 easting_m, northing_m, zone.number);
  if (is_north != zone.is_north)
    northing_m += is_north ? kSouthernNorthing_m : -kSouthernNorthing_m;
  return {easting_m, northing_m, point.altitude_m};
}

GeoPoint GeoFromUtm(const UtmZone& zone, const Eigen::Vector3d& position_m) {
  GeoPoint point;
  GeographicLib::UTMUPS::Reverse(zone.number, zone.is_north, position_m.x(), position_m.y(),
                                 point.latitude_deg, point.longitude_deg);
  point.altitude_m = position_m.z();
  return point;
}

SE3 LocalFromLocal(const GeoPoint& new_origin, const GeoPoint& old_origin) {
  // Both frames are rigid in the Earth's: three points about a metre away tell the turn.
  const GeographicLib::LocalCartesian local = LocalAbout(new_origin);
  const auto moved = [&](const Eigen::Vector3d& position_m) {
    return Forward(local, GeoFromLocal(old_origin, position_m));
  };
  constexpr double kArm_m = 1000;  // Rounding in degrees is then far below a microradian.
  const Eigen::Vector3d origin = moved(Eigen::Vector3d::Zero());
  Eigen::Matrix3d axes;
  for (int i = 0; i < 3; ++i)
    axes.col(i) = (moved(kArm_m * Eigen::Vector3d::Unit(i)) - origin).normalized();
  return {Eigen::Quaterniond(axes), origin};
}

bool HaveAltitudes(const std::vector<GnssFix>& fixes) {
  return std::all_of(fixes.begin(), fixes.end(),
                     [](const GnssFix& fix) { return fix.altitude_m.has_value(); });
}

Trajectory LocalTrajectory(const std::vector<GnssFix>& fixes, bool use_altitude) {
  const bool has_altitude = use_altitude && HaveAltitudes(fixes);
  const auto point_of = [has_altitude](const GnssFix& fix) {
    return GeoPoint{fix.latitude_deg, fix.longitude_deg,
                    has_altitude ? fix.altitude_m.value_or(0) : 0};
  };
  Trajectory trajectory;
  if (fixes.empty()) return trajectory;
  const GeographicLib::LocalCartesian local = LocalAbout(point_of(fixes.front()));
  for (const GnssFix& fix : fixes) {
    trajectory.push_back(
        {fix.time, SE3(Eigen::Quaterniond::Identity(), Forward(local, point_of(fix)))});
  }
  return trajectory;
}

}  // namespace deepuav
