#pragma once

#include <vector>

#include "deepuav/map/map.h"

namespace deepuav {

/// How what is left in a map came to be there.
struct MapGrowth {
  std::vector<Timestamp> times;  ///< Of the keyframes, growing.
  std::vector<int> landmarks;  ///< Made until then; those whose keyframe is gone count for the one
                               ///< before it.
};

MapGrowth GrowthOf(const Map& map);

}  // namespace deepuav
