#pragma once

#include <Eigen/Core>

#include "deepuav/geometry/se3.h"

namespace deepuav {

/// Where a camera is, as rays are made of it.
struct CameraPose {
  Eigen::Matrix3f rotation;
  Eigen::Vector3f position;

  explicit CameraPose(const SE3& world_from_cam)
      : rotation(world_from_cam.RotationMatrix().cast<float>()),
        position(world_from_cam.translation().cast<float>()) {}
};

}  // namespace deepuav
