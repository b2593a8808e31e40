#pragma once

#include <functional>
#include <vector>

#include "deepuav/estimation/poses/motion_only.h"
#include "deepuav/geometry/timed_pose.h"
#include "deepuav/map/atlas.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

/// A frame's pose other than by its anchor.
using PoseOfFrame = std::function<SE3(const FrameRecord&)>;

/// The camera's path in a map: keyframes where the map has them, other frames by their anchored
/// poses or, if given, by `pose_of_frame`.
Trajectory PathIn(const Atlas& atlas, MapId map, const std::vector<FrameRecord>& records,
                  const PoseOfFrame& pose_of_frame = nullptr);

/// Gives located frames the poses that the maps as they are give them.
void PlaceInMaps(const Atlas& atlas, std::vector<FrameRecord>* records);

/// What a frame saw of the map as it is now, with the noise that a camera about there sees it with.
std::vector<PoseObservation> ObservationsOf(const Map& map, const FrameRecord& record,
                                            const SE3& cam_from_world);

}  // namespace deepuav
