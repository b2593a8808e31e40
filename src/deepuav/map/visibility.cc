#include "deepuav/map/visibility.h"

#include <cmath>
#include <numbers>

#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

template <typename AnyLandmark>
std::optional<Eigen::Vector2d> Expect(const AnyLandmark& landmark, const SE3& cam_from_world,
                                      const Camera& camera, const VisibilityOptions& options) {
  const Eigen::Vector3d point_cam = cam_from_world * landmark.position_world;
  if (point_cam.z() <= 0) return std::nullopt;
  const double distance = point_cam.norm();
  if (distance < landmark.min_distance / options.max_distance_factor ||
      distance > landmark.max_distance * options.max_distance_factor) {
    return std::nullopt;
  }
  const Eigen::Vector3d to_camera = cam_from_world.rotation().conjugate() * (-point_cam / distance);
  const double min_cosine = std::cos(options.max_view_angle_deg * std::numbers::pi / 180);
  if (to_camera.dot(landmark.mean_view_direction) < min_cosine) return std::nullopt;
  const auto image_px = camera.Distort(point_cam);
  const bool inside = image_px && image_px->x() >= 0 && image_px->y() >= 0 &&
                      image_px->x() <= camera.width - 1 && image_px->y() <= camera.height - 1;
  if (!inside) return std::nullopt;
  return camera.pinhole.Project(point_cam);
}

}  // namespace

void VisibilityOptions::Check() const { CheckOptions("visibility", *this); }

std::optional<Eigen::Vector2d> ExpectedPixel(const LocalLandmark& landmark,
                                             const SE3& cam_from_world, const Camera& camera,
                                             const VisibilityOptions& options) {
  return Expect(landmark, cam_from_world, camera, options);
}

std::optional<Eigen::Vector2d> ExpectedPixel(const Landmark& landmark, const SE3& cam_from_world,
                                             const Camera& camera,
                                             const VisibilityOptions& options) {
  return Expect(landmark, cam_from_world, camera, options);
}

}  // namespace deepuav
