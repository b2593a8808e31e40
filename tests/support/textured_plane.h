#pragma once

#include <Eigen/Core>
#include <cmath>
#include <opencv2/core.hpp>

#include "deepuav/geometry/rolling_shutter.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/image/image.h"

namespace deepuav {

/// The plane z = 4 + slope.x x + slope.y y of the world, with waves on it that no two places share.
struct TexturedPlane {
  Eigen::Vector2d slope = {0.2, -0.4};

  Eigen::Vector3d Normal() const { return {-slope.x(), -slope.y(), 1}; }
  Eigen::Vector3d Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const {
    return origin + ray * ((4 - Normal().dot(origin)) / Normal().dot(ray));
  }
  double Grey(const Eigen::Vector3d& p) const {
    return 128 + 28 * (std::sin(34 * p.x() + 8 * p.y()) + std::sin(-12 * p.x() + 30 * p.y()) +
                       std::sin(17 * p.x() + 21 * p.y() + 1));
  }
  /// What the camera sees through its lens, moving about the middle row's pose while it reads.
  GreyImage Render(const Camera& camera, const SE3& cam_from_world,
                   const ReadoutMotion& motion = {}) const {
    const SE3 world_from_middle = cam_from_world.Inverse();
    GreyImage image(camera.height, camera.width);
    for (int v = 0; v < camera.height; ++v) {
      const double moment = RowMoment(v, camera.height);
      const SE3 middle_from_row(RotationExp(motion.TurnAt(moment)), moment * motion.travel);
      const SE3 world_from_cam = world_from_middle * middle_from_row;
      for (int u = 0; u < camera.width; ++u) {
        const auto px = camera.Undistort({u, v});
        image(v, u) = 0;
        if (!px) continue;
        const Eigen::Vector3d ray = world_from_cam.rotation() * camera.pinhole.Unproject(*px);
        image(v, u) = cv::saturate_cast<uint8_t>(Grey(Hit(world_from_cam.translation(), ray)));
      }
    }
    return image;
  }
};

}  // namespace deepuav
