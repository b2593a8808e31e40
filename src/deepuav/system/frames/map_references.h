#pragma once

#include <vector>

#include "deepuav/map/atlas.h"
#include "deepuav/map/local_map.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

/// What is referred to of maps, be it still there or not; by rising id.
struct MapReferences {
  std::vector<KeyframeId> keyframes;
  std::vector<LandmarkId> landmarks;
};

/// Of the records, and of the local map (may be null) that the next frames are tracked in.
MapReferences ReferencesOf(const std::vector<FrameRecord>& records, const LocalMap* local_map);

/// Has maps forget what was removed from them and nothing refers to any more, so that a place does
/// not take more memory the longer one stays there. Thread-compatible.
class RemovedForgetter {
 public:
  /// What was removed since the last call is kept: what is under way may still refer to it.
  void Forget(MapReferences referred, Atlas* atlas);

 private:
  MapReferences known_;  ///< Removed things that were kept the last time; sorted.
};

}  // namespace deepuav
