#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "deepuav/geometry/camera.h"
#include "deepuav/io/files/byte_stream.h"
#include "deepuav/map/atlas.h"
#include "deepuav/map/map_state.h"

namespace deepuav {

/// Of the format that is written. Versions 2, without measurements, and 3, without normals, can be
/// read, too.
inline constexpr uint32_t kMapFileVersion = 4;
inline constexpr uint32_t kFirstWithNormals = 4;
inline constexpr uint32_t kOldestMapFileVersion = 2;

/// What the first section of a map file tells.
struct AtlasHead {
  Camera camera;
  IdSource ids;
  uint64_t maps = 0;
  std::string program, features, matcher;  ///< As in MapOrigin.
};

/// The contents of the sections, as docs/map-format.md states them. The readers throw Error where
/// the bytes cannot be what was written.
void PutAtlasHead(const AtlasHead& head, ByteWriter* writer);
AtlasHead GetAtlasHead(std::string_view content);

/// A map without its keyframes' features and images, which have a section each. `id` is its number
/// in the file; `image_names` may hold those of other maps.
void PutMap(const Map& map, MapId id, const std::map<KeyframeId, std::string>& image_names,
            ByteWriter* writer);
/// Adds the names of this map's images to `image_names`. In a file of version 2 observations have
/// no measurements: MeasureAtKeypoints gives them some once the features are there.
MapState GetMap(std::string_view content, uint32_t version,
                std::map<KeyframeId, std::string>* image_names);
/// Every observation that names a key point of a keyframe is where that is.
void MeasureAtKeypoints(MapState* state);

void PutFeatures(KeyframeId keyframe, const Features& features, ByteWriter* writer);
/// `keyframe` is whose features these must be.
Features GetFeatures(KeyframeId keyframe, std::string_view content);

/// `image` may be null.
void PutImage(KeyframeId keyframe, const ImagePyramid* image, ByteWriter* writer);
/// `keyframe` is whose image this must be; null where none was kept.
std::shared_ptr<const ImagePyramid> GetImage(KeyframeId keyframe, std::string_view content);

}  // namespace deepuav
