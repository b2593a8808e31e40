#pragma once

#include <string>
#include <string_view>

#include "deepuav/geometry/camera.h"
#include "deepuav/io/byte_stream.h"
#include "deepuav/map/atlas.h"
#include "deepuav/map/map_state.h"

namespace deepuav {

/// What the first section of a map file tells.
struct AtlasHead {
  Camera camera;
  IdSource ids;
  uint64_t maps = 0;
};

/// The contents of the sections, as docs/map-format.md states them. The readers throw Error where
/// the bytes cannot be what was written.
void PutAtlasHead(const AtlasHead& head, ByteWriter* writer);
AtlasHead GetAtlasHead(std::string_view content);

/// A map without its keyframes' features, which have a section each.
void PutMap(const Map& map, ByteWriter* writer);
MapState GetMap(std::string_view content);

void PutFeatures(KeyframeId keyframe, const Features& features, ByteWriter* writer);
/// `keyframe` is whose features these must be.
Features GetFeatures(KeyframeId keyframe, std::string_view content);

}  // namespace deepuav
