#pragma once

#include <vector>

#include "deepuav/geometry/sim3.h"
#include "deepuav/map/requests.h"

namespace deepuav {

/// A keyframe that was recognised at another keyframe's place, and the landmarks of that place that
/// it sees.
struct LoopTie {
  KeyframeId keyframe, place;
  std::vector<LandmarkMatch> seen;
};

/// How the world around one keyframe moves; its landmarks move with it.
struct KeyframeMove {
  KeyframeId keyframe;
  Sim3 new_from_old;
};

/// What closing a loop or joining two maps changes: a value that looping makes and the Mapper
/// applies in one step.
struct MapCorrection {
  MapId map;                            ///< That is corrected.
  MapId into;                           ///< That it becomes part of; `map` itself for a loop.
  Sim3 into_from_map;                   ///< Where it becomes part of another.
  std::vector<KeyframeMove> keyframes;  ///< For a loop: all keyframes of the map that move.
  std::vector<LoopTie> ties;            ///< The newest last.

  bool merges() const { return map != into; }
};

}  // namespace deepuav
