#pragma once

#include <map>
#include <set>
#include <vector>

#include "deepuav/geometry/se3.h"
#include "deepuav/map/frame.h"

namespace deepuav {

/// A camera's pose seen from a keyframe, so that it moves and scales with the map around it.
struct AnchoredPose {
  KeyframeId keyframe;
  SE3 cam_from_keyframe;
  double keyframe_scale = 1;  ///< Keyframe::scale when the pose was taken.
};

/// A frame kept in the map.
struct Keyframe {
  KeyframeId id;
  Frame frame;
  SE3 cam_from_world;
  /// By how much all lengths around it have grown since it was made: loop corrections and merging
  /// change the scale of one part of a map against another.
  double scale = 1;
  std::vector<LandmarkId> landmarks;    ///< One per key point; invalid where there is none.
  std::map<KeyframeId, int> covisible;  ///< Keyframes that share landmarks, and how many.
  KeyframeId parent;                    ///< In the spanning tree; invalid for the root.
  std::set<KeyframeId> children;
  std::set<KeyframeId> loops;  ///< Keyframes tied to it by a closed loop.

  const Features& features() const { return *frame.features; }
  /// While its image was read, in the map's units as they are now.
  ReadoutMotion motion() const {
    return {frame.motion.turn_rad, scale * frame.motion.travel, frame.motion.bend_rad};
  }
  int LandmarkCount() const;
};

/// What stays known of a removed keyframe: where it was, seen from one that stayed on then.
struct CulledKeyframe {
  AnchoredPose pose;
  double scale = 1;  ///< Keyframe::scale when it was removed.
};

}  // namespace deepuav
