#pragma once

#include "deepuav/localisation/frame_locator.h"
#include "deepuav/map/map.h"
#include "deepuav/system/frames/frame_record.h"
#include "deepuav/tracking/tracked_pose.h"

namespace deepuav {

/// What a located neighbour tells of a frame at `time`. `before`: a frame of the same map on the
/// neighbour's other side, which tells how the camera moved; may be null.
LocationPrior PriorBeside(const Map& map, const FrameRecord& neighbour, const FrameRecord* before,
                          Timestamp time);

/// The record of a frame that was located.
FrameRecord LocatedRecord(const Frame& frame, const TrackedPose& pose);

/// What of it is needed to locate a frame again.
Frame FrameToLocate(const FrameRecord& record);

}  // namespace deepuav
