#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/features/descriptors.h"

namespace deepuav {

struct Keypoint {
  Eigen::Vector2f image_px;  ///< In the image as taken.
  Eigen::Vector2f px;        ///< In the undistorted pinhole camera: what all geometry uses.
  float score = 0;           ///< Detection probability in 0..1.
  float sigma_px = 1;        ///< Standard deviation of `px` per axis.
};

/// What is kept of an image: key points and their descriptors, row i for key point i, by falling
/// score. Const after extraction and shared between threads.
struct Features {
  std::vector<Keypoint> keypoints;
  Descriptors descriptors;

  int size() const { return static_cast<int>(keypoints.size()); }
};

}  // namespace deepuav
