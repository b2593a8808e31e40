#pragma once

#include <filesystem>

#include "deepuav/geometry/camera.h"
#include "deepuav/map/atlas.h"

namespace deepuav {

/// All maps of a run and the camera that made them.
struct LoadedAtlas {
  Atlas atlas;
  Camera camera;
};

/// Writes all that is needed to go on with the maps, bit for bit, in the format of
/// docs/map-format.md, atomically. Throws Error naming the file.
void WriteMapFile(const std::filesystem::path& file, const Atlas& atlas, const Camera& camera);

/// Reads what WriteMapFile wrote. Memory grows with the file, whatever it says. Throws Error naming
/// the file, what was found and what was expected: for a file that is no map, newer, truncated,
/// damaged, or whose parts contradict one another.
LoadedAtlas ReadMapFile(const std::filesystem::path& file);

}  // namespace deepuav
