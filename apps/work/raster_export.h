#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "deepuav/io/maps/map_file.h"

namespace deepuav {

/// What the command line says of orthophotos and DSMs.
struct RasterArguments {
  std::string images;
  double resolution = 0;
};

/// --images and --resolution.
void AddRasterArguments(CLI::App& command, RasterArguments& arguments);

/// Writes the map's orthophoto as GeoTIFF, and tells on stdout what it is. Without --images its
/// photographs are looked for where the run that wrote `map_file` had them. Throws Error.
void ExportOrthophoto(const std::filesystem::path& out, const LoadedAtlas& loaded, MapId map,
                      const std::filesystem::path& map_file, const RasterArguments& arguments);

/// The same of its heights, which needs no photographs.
void ExportDsm(const std::filesystem::path& out, const LoadedAtlas& loaded, MapId map,
               const RasterArguments& arguments);

}  // namespace deepuav
