#pragma once

#include <filesystem>

#include "deepuav/geometry/camera.h"
#include "deepuav/io/files/yaml_map.h"

namespace deepuav {

/// What a camera.yaml says.
struct CameraFile {
  Camera camera;
  /// `model: auto`: the values are only where to start from.
  bool refine = false;
  /// False for `model: auto` without fx, fy, cx, cy: the intrinsics are to be taken from EXIF,
  /// `camera` holds at most the rate.
  bool has_intrinsics = true;
};

/// Reads `model: pinhole | radial_tangential | equidistant | auto`, width, height, fx, fy, cx, cy
/// (px), distortion (4 or 5, or 4 coefficients, none for a pinhole), rate_hz and readout_ms
/// (optional). For `auto` everything but the model may be left out. Calibrations of other programs
/// (calibration_formats.h) are read as well. Throws Error naming file, line, field, what was found
/// and what was expected.
CameraFile ReadCameraFile(const std::filesystem::path& file);

/// The same where there is no EXIF to fall back on: throws Error when the intrinsics are not given.
CameraFile ReadCompleteCameraFile(const std::filesystem::path& file);

/// Throws Error unless `count` coefficients suit the lens.
void CheckDistortionCount(LensModel lens, size_t count, const std::string& where,
                          const std::string& field);

/// The optional `readout_ms` of a camera's description in seconds, 0 where it is not given. Throws
/// Error for what no shutter takes.
double ReadReadout(const YamlMap& yaml);

/// No image of a camera is longer on one side: what is comes of a damaged file, and would only
/// exhaust the memory.
inline constexpr int kMaxImageSidePx = 30000;

}  // namespace deepuav
