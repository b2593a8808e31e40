#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

#include "deepuav/io/maps/map_file.h"
#include "work/run_images.h"

namespace deepuav {

/// What the command line says of orthophotos and DSMs.
struct RasterArguments {
  double resolution = 0;
};

/// --resolution.
void AddRasterArguments(CLI::App& command, RasterArguments& arguments);

/// Writes the map's orthophoto as GeoTIFF, and tells on stdout what it is. Throws Error.
void ExportOrthophoto(const std::filesystem::path& out, const LoadedAtlas& loaded, MapId map,
                      const RunImages& images, const RasterArguments& arguments);

/// The same of its heights, which needs no photographs.
void ExportDsm(const std::filesystem::path& out, const LoadedAtlas& loaded, MapId map,
               const RasterArguments& arguments);

}  // namespace deepuav
