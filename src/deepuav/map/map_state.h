#pragma once

#include <map>
#include <vector>

#include "deepuav/map/keyframe.h"
#include "deepuav/map/landmark.h"

namespace deepuav {

/// What a map consists of, for Map::Restore. What follows from it is left empty: the keyframes'
/// landmarks, covisible keyframes and children.
struct MapState {
  MapId id;
  double model_sigma_px = 0;
  std::vector<Keyframe> keyframes;  ///< By id.
  std::vector<Landmark> landmarks;  ///< By id.
  std::map<KeyframeId, CulledKeyframe> culled;
  std::map<LandmarkId, LandmarkId> merged_into;
};

}  // namespace deepuav
