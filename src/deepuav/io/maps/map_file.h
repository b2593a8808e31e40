#pragma once

#include <filesystem>

#include <map>
#include <string>

#include "deepuav/geometry/camera.h"
#include "deepuav/io/files/section_file.h"
#include "deepuav/io/geodata/map_origin.h"
#include "deepuav/map/atlas.h"

namespace deepuav {

/// All maps of a run, the camera that made them, and where they come from.
struct LoadedAtlas {
  Atlas atlas;
  Camera camera;
  MapOrigin origin;
};

/// The file itself.
struct MapFileFacts {
  uint32_t version = 0;  ///< Of the format.
  uint64_t bytes = 0;
  std::map<std::string, SectionTally> sections;  ///< By kind.
};

/// By the atlas's maps, their numbers in its file: 0, 1, ... of those that remain.
std::map<MapId, int64_t> NumbersInFile(const Atlas& atlas);

/// Writes all that is needed to go on with the maps, bit for bit, in the format of
/// docs/map-format.md, atomically. Throws Error naming the file.
void WriteMapFile(const std::filesystem::path& file, const Atlas& atlas, const Camera& camera,
                  const MapOrigin& origin);

/// Reads what WriteMapFile wrote. Memory grows with the file, whatever it says. Throws Error naming
/// the file, what was found and what was expected: for a file that is no map, newer, truncated,
/// damaged, or whose parts contradict one another.
LoadedAtlas ReadMapFile(const std::filesystem::path& file, MapFileFacts* facts = nullptr);

}  // namespace deepuav
