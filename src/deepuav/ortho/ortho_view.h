#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/rolling_shutter.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/ortho/ground_frame.h"

namespace deepuav {

/// A photograph.
struct OrthoView {
  SE3 cam_from_world;
  ReadoutMotion motion;
};

/// What an orthophoto is made of, without the photographs' pixels.
struct OrthoScene {
  Camera camera;  ///< Of all views. Pixels of its size mean a photograph scaled to it.
  std::vector<OrthoView> views;
  GroundFrame frame;
};

/// Where a photograph of `camera` shows a point.
struct SeenAt {
  Eigen::Vector2d px;
  double depth = 0;
};

/// Nothing where the view does not show it: behind the camera, outside the lens's range. May lie
/// outside the image.
inline std::optional<SeenAt> Look(const Camera& camera, const OrthoView& view,
                                  const Eigen::Vector3d& world) {
  const Eigen::Vector3d point = view.cam_from_world * world;
  if (!(point.z() > 0)) return std::nullopt;
  const auto px = DistortInRow(camera, camera.pinhole.Project(point), view.motion, 1 / point.z());
  if (!px) return std::nullopt;
  return SeenAt{*px, point.z()};
}

}  // namespace deepuav
