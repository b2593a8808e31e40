#pragma once

#include <filesystem>
#include <optional>
#include <span>

#include "deepuav/io/maps/point_cloud.h"

namespace deepuav {

/// Writes the points as LAS 1.2 (ASPRS, 2008), point format 2 (position and colour), atomically:
/// without a coordinate system, or with that of `epsg` (projected, metres) as GeoTIFF keys.
/// Coordinates are multiples of a power of ten: a millionth of the unit where the extent allows it.
/// The same points give the same bytes: the day of creation is left out. Throws Error naming the
/// file, also for a position that is not finite.
void WriteLas(const std::filesystem::path& file, std::span<const ColouredPoint> points,
              std::optional<int> epsg = std::nullopt);

}  // namespace deepuav
