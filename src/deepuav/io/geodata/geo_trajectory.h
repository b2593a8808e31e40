#pragma once

#include <filesystem>

#include "deepuav/geometry/geo_point.h"
#include "deepuav/geometry/timed_pose.h"

namespace deepuav {

// A path in metres east, north and up of `origin`, in formats of maps: WGS 84, one point a pose.
// Each file is written atomically. Throws Error naming the file, also for a position that is not
// finite.

/// A Feature with a LineString and the poses' times (RFC 7946).
void WriteGeoJson(const std::filesystem::path& file, const GeoPoint& origin,
                  const Trajectory& path);
/// A LineString at absolute altitudes (KML 2.2).
void WriteKml(const std::filesystem::path& file, const GeoPoint& origin, const Trajectory& path);
/// A track with times (GPX 1.1).
void WriteGpx(const std::filesystem::path& file, const GeoPoint& origin, const Trajectory& path);

}  // namespace deepuav
