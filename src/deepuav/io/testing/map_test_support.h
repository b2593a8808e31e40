#pragma once

#include "deepuav/geometry/camera.h"
#include "deepuav/io/geodata/map_origin.h"
#include "deepuav/map/atlas.h"

namespace deepuav {

Camera TestMapCamera();

/// With names for the first keyframes.
MapOrigin TestMapOrigin();

/// A map as a run leaves it: `keyframes` of `keypoints` key points with descriptors of `dimension`,
/// landmarks seen by several, and, where there are enough keyframes, some culled, a loop closed and
/// scales changed by it, landmarks merged and removed.
Map TestMap(MapId id, int keyframes, int keypoints, int dimension, uint64_t seed, IdSource* ids);

/// Two such maps, and an empty one between them.
Atlas TestAtlas(int keyframes, int keypoints, int dimension, uint64_t seed);

/// Fails the test unless all is equal to the bit, also what a map derives.
void ExpectSameAtlas(const Atlas& a, const Atlas& b);

}  // namespace deepuav
