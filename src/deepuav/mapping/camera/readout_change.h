#pragma once

#include <map>

#include "deepuav/geometry/camera.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// Has keyframes move otherwise than was taken so far while they were read, in the map's units:
/// their key points and what was measured in them get the places that the middle row would have
/// seen then.
void ChangeMotions(const std::map<KeyframeId, ReadoutMotion>& motions, const Camera& camera,
                   Map* map);

}  // namespace deepuav
