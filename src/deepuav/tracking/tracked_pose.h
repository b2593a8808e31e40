#pragma once

#include <cstdint>
#include <vector>

#include "deepuav/localisation/frame_locator.h"
#include "deepuav/map/local_map.h"
#include "deepuav/map/requests.h"

namespace deepuav {

/// A frame's place in the map, relative to a keyframe so that it moves with the map.
struct TrackedPose {
  MapId map;
  AnchoredPose anchored;
  std::vector<LandmarkMatch> matches;
  SE3 cam_from_world = {};                  ///< In the local map that it was located in...
  int64_t map_revision = 0;                 ///< ...as of LocalMap::revision.
  Matrix6d information = Matrix6d::Zero();  ///< As of LocatedFrame.
  ReadoutMotion motion = {};                ///< What the matches' pixels are corrected for.
};

/// That of a frame that was located in `local_map`.
TrackedPose PoseIn(const LocalMap& local_map, const LocatedFrame& located);

}  // namespace deepuav
