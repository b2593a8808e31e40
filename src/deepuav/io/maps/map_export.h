#pragma once

#include <vector>

#include "deepuav/io/geodata/trajectory.h"
#include "deepuav/io/maps/point_cloud.h"
#include "deepuav/map/map.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {

/// The poses of the keyframes from `first` on, by growing time.
Trajectory KeyframeTrajectory(const Map& map, KeyframeId first = {0});

/// The landmarks by id, in the map's world, in the grey of their images: a map holds no colours.
std::vector<ColouredPoint> LandmarkPoints(const Map& map);

/// From a georeferenced map's world to easting, northing and altitude in a zone.
void MoveIntoUtm(const GeoPoint& origin, const UtmZone& zone, std::vector<ColouredPoint>* points);

}  // namespace deepuav
