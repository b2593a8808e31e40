#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <string_view>

namespace deepuav {

/// From the coordinates of a reference system, as of a national grid, to latitude and longitude on
/// WGS 84 (by PROJ). Not to be shared between threads.
class GridCoordinates {
 public:
  /// "EPSG:25832", "WGS84 UTM 32N", a PROJ string or WKT. Throws Error naming `where` for what is
  /// no known system.
  GridCoordinates(std::string_view system, const std::string& where);

  /// Latitude and longitude, degrees, of x (east, or longitude) and y (north, or latitude). Throws
  /// Error naming `where` for a point outside of the system.
  Eigen::Vector2d LatitudeLongitude(double x, double y, const std::string& where) const;

 private:
  std::string system_;
  std::unique_ptr<void, void (*)(void*)> transformation_;
};

/// Whether a line is the name of a reference system, as GridCoordinates takes it.
bool NamesReferenceSystem(std::string_view line);

}  // namespace deepuav
