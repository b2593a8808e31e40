#pragma once

#include <string>

#include "deepuav/system/slam.h"

namespace deepuav {

/// What became of every frame, as CSV: frame, time_ns, state (tracked: had its pose when its turn
/// came; located: has one since the end of the run; initialising or lost: has none), map (empty
/// where there is none; numbered as in map.deepuav), key_points (found in the image), landmarks
/// (that spoke for the pose), keyframe (empty where it is none), reason (why there was no pose).
/// Keyframes before `first_new_keyframe` are of an earlier run.
std::string FrameTable(const Atlas& atlas, const SlamResult& result, KeyframeId first_new_keyframe);

/// The pose of every frame that has one, as CSV: frame, time_ns, map, position (x, y, z) and
/// orientation (qx, qy, qz, qw: world from camera), then the upper triangle of the covariance of
/// position and turn about the world's axes, row by row; empty where it is not known.
std::string PoseTable(const Atlas& atlas, const SlamResult& result);

}  // namespace deepuav
