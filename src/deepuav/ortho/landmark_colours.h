#pragma once

#include <functional>
#include <string>
#include <vector>

#include "deepuav/geometry/camera.h"
#include "deepuav/io/maps/point_cloud.h"
#include "deepuav/map/map.h"
#include "deepuav/ortho/photographs.h"

namespace deepuav {

/// Gives LandmarkPoints() the colours that the images of their representative observations have
/// there. `photographs`: of the map's keyframes in their order, read at the size of `camera`.
/// Points whose image `unreadable` is told of, or ends above them, stay as they are.
void ColourPoints(const Map& map, const Camera& camera, Photographs* photographs,
                  const std::function<void(const std::string& why)>& unreadable,
                  std::vector<ColouredPoint>* points);

}  // namespace deepuav
