#pragma once

#include <vector>

#include "deepuav/io/point_cloud.h"
#include "deepuav/io/trajectory.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// The poses of the keyframes from `first` on, by growing time.
Trajectory KeyframeTrajectory(const Map& map, KeyframeId first = {0});

/// The landmarks by id, in the map's world. Grey: a map holds no colours.
std::vector<ColoredPoint> LandmarkPoints(const Map& map);

}  // namespace deepuav
