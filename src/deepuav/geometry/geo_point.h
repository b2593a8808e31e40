#pragma once

namespace deepuav {

/// A point of the Earth: WGS 84, the altitude above the ellipsoid, or of whatever origin those of
/// the fixes have.
struct GeoPoint {
  double latitude_deg = 0, longitude_deg = 0, altitude_m = 0;

  bool operator==(const GeoPoint&) const = default;
};

}  // namespace deepuav
