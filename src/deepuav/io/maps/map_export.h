#pragma once

#include <vector>

#include "deepuav/io/geodata/trajectory.h"
#include "deepuav/io/maps/point_cloud.h"
#include "deepuav/map/map.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {

/// The poses of the keyframes from `first` on, by growing time.
Trajectory KeyframeTrajectory(const Map& map, KeyframeId first = {0});

/// The landmarks by id, in the map's world. Grey: a map holds no colours.
std::vector<ColouredPoint> LandmarkPoints(const Map& map);

/// The same where the map is georeferenced: easting, northing and altitude in a zone.
std::vector<ColouredPoint> LandmarkPointsInUtm(const Map& map, const GeoPoint& origin,
                                               const UtmZone& zone);

}  // namespace deepuav
