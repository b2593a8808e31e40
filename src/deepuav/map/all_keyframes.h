#pragma once

#include <vector>

#include "deepuav/map/map.h"

namespace deepuav {

/// The map's keyframes, by id.
inline std::vector<KeyframeId> AllKeyframes(const Map& map) {
  std::vector<KeyframeId> all;
  map.keyframes().ForEach([&all](const Keyframe& keyframe) { all.push_back(keyframe.id); });
  return all;
}

}  // namespace deepuav
