#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/io/cameras/camera_file.h"

namespace deepuav {

/// What holds for every camera that a reader gives.
inline void CheckCamera(const Camera& camera) {
  EXPECT_GT(camera.width, 0);
  EXPECT_LE(camera.width, kMaxImageSidePx);
  EXPECT_LE(camera.height, kMaxImageSidePx);
  EXPECT_TRUE(std::isfinite(camera.pinhole.fx) && camera.pinhole.fx > 0);
  for (const double coefficient : camera.distortion) EXPECT_TRUE(std::isfinite(coefficient));
}

}  // namespace deepuav
