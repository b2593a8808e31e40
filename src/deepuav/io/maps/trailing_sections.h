#pragma once

#include <map>
#include <string_view>

#include "deepuav/base/ids.h"
#include "deepuav/geometry/rolling_shutter.h"
#include "deepuav/io/files/byte_stream.h"
#include "deepuav/map/gauge.h"

namespace deepuav {

// The contents of the sections that may follow the maps (docs/map-format.md). Readers throw Error
// for what cannot be.

/// Where maps are on Earth, by their numbers in the file; of those that are georeferenced.
void PutGauges(const std::map<MapId, Gauge>& gauges, ByteWriter* writer);
std::map<MapId, Gauge> GetGauges(std::string_view content);
/// The same of those that are metric and level, but nowhere on Earth.
void PutMetricGauges(const std::map<MapId, Gauge>& gauges, ByteWriter* writer);
std::map<MapId, Gauge> GetMetricGauges(std::string_view content);

/// How cameras moved while keyframes were read, of those that did.
void PutMotions(const std::map<KeyframeId, ReadoutMotion>& motions, ByteWriter* writer);
/// `with_bends`: as written; files from before have none.
std::map<KeyframeId, ReadoutMotion> GetMotions(std::string_view content, bool with_bends = true);

}  // namespace deepuav
