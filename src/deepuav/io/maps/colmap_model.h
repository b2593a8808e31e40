#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "deepuav/geometry/camera.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// Writes the map as a COLMAP text model: cameras.txt, images.txt and points3D.txt in `folder`,
/// made if absent, each file atomically. The images are those as taken: the camera is a PINHOLE,
/// OPENCV, FULL_OPENCV or OPENCV_FISHEYE with the distortion, and every key point is there, with
/// the landmark it shows. Pixels move by half of one, as COLMAP has the centre of the first at
/// (0.5, 0.5). Image and point are numbered by keyframe and landmark plus one. A keyframe
/// without a name in `image_names` gets its time in nanoseconds; blanks, at which COLMAP cuts a
/// name, become underscores. Throws Error naming the file.
void WriteColmapModel(const std::filesystem::path& folder, const Map& map, const Camera& camera,
                      const std::map<KeyframeId, std::string>& image_names);

}  // namespace deepuav
