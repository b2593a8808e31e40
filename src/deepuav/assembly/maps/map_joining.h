#pragma once

#include <vector>

#include "deepuav/system/slam.h"

namespace deepuav {

struct JoiningReport {
  int merged_maps = 0, closed_loops = 0;
};

/// Joins maps that show the same places: looks at the keyframes of `newer` maps one after the other
/// as if they had just been made beside the other maps of the atlas, then adjusts every map that
/// changed. Throws Error where `perception` has no vocabulary. Descriptors are only known under the
/// heading they were taken with.
JoiningReport JoinMaps(const Camera& camera, const SystemOptions& options,
                       const Perception& perception, const std::vector<MapId>& newer, Atlas* atlas);

}  // namespace deepuav
