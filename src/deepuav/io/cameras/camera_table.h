#pragma once

#include <filesystem>
#include <optional>

#include "deepuav/geometry/geo_point.h"
#include "deepuav/io/geodata/map_origin.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// Writes the keyframes by time as CSV, atomically: image, time, position and orientation
/// (world_from_cam) and, with `origin`, their place on Earth (WGS 84). Throws Error naming the
/// file, also for a position that is not finite.
void WriteCameraTable(const std::filesystem::path& file, const Map& map,
                      const ImageNames& image_names, const std::optional<GeoPoint>& origin);

}  // namespace deepuav
