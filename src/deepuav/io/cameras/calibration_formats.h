#pragma once

#include <filesystem>
#include <optional>

#include "deepuav/geometry/camera.h"
#include "deepuav/io/files/yaml_map.h"

namespace deepuav {

/// The camera of a calibration as other programs write it, by the names of its fields; of several
/// cameras the first:
/// - Kalibr's camchain.yaml and EuRoC's sensor.yaml: camera_model, intrinsics, resolution, ...,
/// - ROS's camera_info and OpenCV's calibration: image_width, camera_matrix, ...,
/// - settings of ORB-SLAM2 and 3: Camera.type, Camera.fx or Camera1.fx, ...
///
/// Nothing for a file that is none of these. Throws Error naming file, line and field for what is
/// missing or of a kind that is not supported.
std::optional<Camera> CameraOfOtherPrograms(const YamlMap& yaml);

/// The camera of one of Kalibr's cameras, or of EuRoC's sensor.yaml. Throws as above.
Camera KalibrCamera(const YamlMap& yaml);

/// The camera of COLMAP's cameras.txt, of which there must be one. Throws Error naming file and
/// line.
Camera ReadColmapCamera(const std::filesystem::path& file);

}  // namespace deepuav
