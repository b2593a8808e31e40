#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "deepuav/viewer/view_state.h"

namespace deepuav {

// Binary messages for the page: the length of a JSON header as 32 bits little-endian, the header,
// what it describes.

/// Header: kind "picture", frame, width, height, points. Then two 16-bit shares of width and height
/// a point, then a JPEG.
std::string PictureMessage(const FrameView& frame);

/// Header: kind "map", map, up, points, keyframes, path, loops, and what the points are packed with
/// (low, size). Then three 16-bit shares a point, seven floats a keyframe (position, quaternion x y
/// z w), three floats a frame of the path, six floats a loop (two positions).
std::string MapMessage(const MapView& map);

/// [x, y, z, qx, qy, qz, qw].
nlohmann::json PoseJson(const SE3& world_from_cam);

}  // namespace deepuav
