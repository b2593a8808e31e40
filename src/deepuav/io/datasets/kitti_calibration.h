#pragma once

#include <filesystem>

#include "deepuav/geometry/camera.h"

namespace deepuav {

/// The camera of the line "P0: ..." (a 3x4 projection by rows) of KITTI's calib.txt; the file does
/// not give the image size. Throws Error naming file and line.
Pinhole ReadKittiCalibration(const std::filesystem::path& file);

}  // namespace deepuav
