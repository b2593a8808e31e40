#pragma once

#include <map>
#include <set>
#include <vector>

#include "deepuav/geometry/se3.h"
#include "deepuav/map/frame.h"

namespace deepuav {

/// A frame kept in the map.
struct Keyframe {
  KeyframeId id;
  Frame frame;
  SE3 cam_from_world;
  std::vector<LandmarkId> landmarks;    ///< One per key point; invalid where there is none.
  std::map<KeyframeId, int> covisible;  ///< Keyframes that share landmarks, and how many.
  KeyframeId parent;                    ///< In the spanning tree; invalid for the root.
  std::set<KeyframeId> children;

  const Features& features() const { return *frame.features; }
  int LandmarkCount() const;
};

/// Where a removed keyframe was, seen from one that stayed on then.
struct CulledPose {
  KeyframeId parent;
  SE3 cam_from_parent;
};

}  // namespace deepuav
