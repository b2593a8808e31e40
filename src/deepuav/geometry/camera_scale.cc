#include "deepuav/geometry/camera_scale.h"

#include <utility>

namespace deepuav {
namespace {

/// (x, y) of the image goes to (height - 1 - y, x).
Camera TurnedOnce(const Camera& camera) {
  Camera turned = camera;
  std::swap(turned.width, turned.height);
  turned.pinhole = {camera.pinhole.fy, camera.pinhole.fx, camera.height - 1 - camera.pinhole.cy,
                    camera.pinhole.cx};
  if (camera.lens == LensModel::kRadialTangential) {
    turned.distortion[2] = camera.distortion[3];
    turned.distortion[3] = -camera.distortion[2];
  }
  return turned;
}

}  // namespace

Camera ScaledCamera(const Camera& camera, int width, int height) {
  const double x = static_cast<double>(width) / camera.width;
  const double y = static_cast<double>(height) / camera.height;
  Camera scaled = camera;
  scaled.width = width;
  scaled.height = height;
  const Pinhole& from = camera.pinhole;
  scaled.pinhole = {x * from.fx, y * from.fy, x * (from.cx + 0.5) - 0.5, y * (from.cy + 0.5) - 0.5};
  return scaled;
}

Camera TurnedCamera(const Camera& camera, int quarter_turns) {
  Camera turned = camera;
  for (int i = 0; i < (quarter_turns % 4 + 4) % 4; ++i) turned = TurnedOnce(turned);
  return turned;
}

}  // namespace deepuav
