#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/geometry/camera.h"

namespace deepuav {

/// The ray of every pixel of a camera, at depth 1: a hit's ray parameter is its depth.
class CameraRays {
 public:
  CameraRays(const Camera& camera, int threads);

  /// The ray through the pixel's centre; NaN where the lens has none.
  const Eigen::Vector2f& At(int x, int y) const {
    return rays_[static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)];
  }

  /// The ray of a place `offset` px (less than 1) from the pixel's centre.
  Eigen::Vector2f At(int x, int y, const Eigen::Vector2f& offset) const;

  int width() const { return width_; }
  int height() const { return height_; }

  /// Typical size of a pixel at depth 1.
  float pixel_size() const { return pixel_size_; }

 private:
  int width_, height_;
  float pixel_size_;
  std::vector<Eigen::Vector2f> rays_;
};

}  // namespace deepuav
