#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/geometry/geo_point.h"
#include "deepuav/geometry/timed_pose.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

/// One without altitude is at that of the ellipsoid.
GeoPoint PlaceOf(const GnssFix& fix);

/// Metres east, north and up of `origin`, in the plane that touches the ellipsoid there, and back
/// (GeographicLib's LocalCartesian).
Eigen::Vector3d LocalFromGeo(const GeoPoint& origin, const GeoPoint& point);
GeoPoint GeoFromLocal(const GeoPoint& origin, const Eigen::Vector3d& position_m);

/// A zone of the Universal Transverse Mercator grid on WGS 84.
struct UtmZone {
  int number = 0;  ///< 1 to 60.
  bool is_north = true;

  int Epsg() const { return (is_north ? 32600 : 32700) + number; }
};

/// Throws Error near the poles, where there is none.
UtmZone UtmZoneOf(const GeoPoint& point);
/// Easting, northing and the point's altitude, metres, in this zone even where it lies beside it.
Eigen::Vector3d UtmFromGeo(const UtmZone& zone, const GeoPoint& point);

/// The inverse of UtmFromGeo.
GeoPoint GeoFromUtm(const UtmZone& zone, const Eigen::Vector3d& position_m);

/// What takes positions about one origin to those about another.
SE3 LocalFromLocal(const GeoPoint& new_origin, const GeoPoint& old_origin);

bool HaveAltitudes(const std::vector<GnssFix>& fixes);

/// The fixes in metres east, north and up of the first. Without `use_altitude`, or where any fix
/// has no altitude, all are taken at the ellipsoid's height.
Trajectory LocalTrajectory(const std::vector<GnssFix>& fixes, bool use_altitude);

}  // namespace deepuav
