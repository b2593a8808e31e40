#pragma once

#include "deepuav/geometry/camera.h"
#include "deepuav/map/frame.h"

namespace deepuav {

/// The frame with its key points corrected for how the camera moved while it was read, instead of
/// for what they were corrected for.
Frame WithMotion(Frame frame, const ReadoutMotion& motion, const Camera& camera);

/// Travelling as `motion` says, turning as another does.
ReadoutMotion WithTurnOf(const ReadoutMotion& turning, ReadoutMotion motion);

/// WithMotion for a camera that moved on as since (or until) another view, `between_s` earlier; a
/// turn that a gyroscope measured stays. The frame as it is where the camera reads all rows at
/// once.
Frame MovingOn(const Frame& frame, const SE3& cam_from_world, const SE3& other_from_world,
               double between_s, const Camera& camera);

}  // namespace deepuav
