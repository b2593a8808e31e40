#include "deepuav/simulation/rendering/camera_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/simulation/rendering/parallel_rows.h"

namespace deepuav {

CameraRays::CameraRays(const Camera& camera, int threads)
    : width_(camera.width),
      height_(camera.height),
      pixel_size_(static_cast<float>(1 / std::sqrt(camera.pinhole.fx * camera.pinhole.fy))) {
  rays_.resize(static_cast<size_t>(width_) * static_cast<size_t>(height_));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  ForRowsInParallel(height_, threads, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      for (int x = 0; x < width_; ++x) {
        Eigen::Vector2f& ray =
            rays_[static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)];
        const auto pixel = camera.Undistort(Eigen::Vector2d(x, y));
        ray = pixel ? Eigen::Vector2f(camera.pinhole.Unproject(*pixel).head<2>().cast<float>())
                    : Eigen::Vector2f(nan, nan);
      }
    }
  });
}

Eigen::Vector2f CameraRays::At(int x, int y, const Eigen::Vector2f& offset) const {
  const Eigen::Vector2f& centre = At(x, y);
  const Eigen::Vector2f& left = At(std::max(x - 1, 0), y);
  const Eigen::Vector2f& right = At(std::min(x + 1, width_ - 1), y);
  const Eigen::Vector2f& up = At(x, std::max(y - 1, 0));
  const Eigen::Vector2f& down = At(x, std::min(y + 1, height_ - 1));
  const float columns = x > 0 && x + 1 < width_ ? 2.0f : 1.0f;
  const float rows = y > 0 && y + 1 < height_ ? 2.0f : 1.0f;
  return centre + offset.x() / columns * (right - left) + offset.y() / rows * (down - up);
}

}  // namespace deepuav
