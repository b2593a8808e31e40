#pragma once

#include <filesystem>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// A camera's sensor.yaml of the EuRoC/ASL format.
struct EurocSensor {
  Camera camera;
  SE3 body_from_cam;  ///< T_BS
};

/// Throws Error naming file, line and field, what was found and what was expected.
EurocSensor ReadEurocSensor(const std::filesystem::path& file);

/// The T_BS of any sensor's sensor.yaml. Throws as above.
SE3 ReadEurocBodyFromSensor(const std::filesystem::path& file);

}  // namespace deepuav
