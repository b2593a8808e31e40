#pragma once

#include <filesystem>

#include "deepuav/io/maps/map_file.h"
#include "work/run_images.h"

namespace deepuav {

/// Write the map's landmarks, in colour where the images are found; where they are not, or are not
/// of this map, in grey, which is said on stdout. Throw Error, also for named images that cannot be
/// opened.
void ExportPly(const std::filesystem::path& out, const LoadedAtlas& loaded, MapId map,
               const RunImages& images);
/// In UTM where the map is georeferenced.
void ExportLas(const std::filesystem::path& out, const LoadedAtlas& loaded, MapId map,
               const RunImages& images);

}  // namespace deepuav
