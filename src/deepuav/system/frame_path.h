#pragma once

#include <functional>
#include <vector>

#include "deepuav/geometry/timed_pose.h"
#include "deepuav/map/atlas.h"
#include "deepuav/system/frame_record.h"

namespace deepuav {

/// A frame's pose other than by its anchor.
using PoseOfFrame = std::function<SE3(const FrameRecord&)>;

/// The camera's path in a map: keyframes where the map has them, other frames by their anchored
/// poses or, if given, by `pose_of_frame`.
Trajectory PathIn(const Atlas& atlas, MapId map, const std::vector<FrameRecord>& records,
                  const PoseOfFrame& pose_of_frame = nullptr);

}  // namespace deepuav
