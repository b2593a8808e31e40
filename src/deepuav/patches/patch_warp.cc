#include "deepuav/patches/patch_warp.h"

#include <Eigen/LU>
#include <cmath>

namespace deepuav {
namespace {

/// Seen at less than this many degrees above the plane, a patch shows nothing of use.
constexpr double kMinSineOfGrazing = 0.1;  // 6 degrees

constexpr double kDistortionStepPx = 0.5;

/// d point / d undistorted pixel, of the point where the plane meets the pixel's ray.
std::optional<Eigen::Matrix<double, 3, 2>> PlaneJacobian(const SurfacePatch& patch,
                                                         const Pinhole& pinhole) {
  const Eigen::Vector3d ray = pinhole.Unproject(patch.px);
  const double slope = patch.normal_cam.dot(ray);
  if (std::abs(slope) < kMinSineOfGrazing * patch.normal_cam.norm() * ray.norm())
    return std::nullopt;
  const double depth = patch.normal_cam.dot(patch.point_cam) / slope;
  Eigen::Matrix<double, 3, 2> jacobian;
  jacobian.col(0) = Eigen::Vector3d(1 / pinhole.fx, 0, 0);
  jacobian.col(1) = Eigen::Vector3d(0, 1 / pinhole.fy, 0);
  const Eigen::RowVector2d along_normal = patch.normal_cam.transpose() * jacobian / slope;
  return depth * (jacobian - ray * along_normal);
}

}  // namespace

std::optional<Eigen::Matrix2d> DistortionJacobian(const Camera& camera, const Eigen::Vector2d& px) {
  if (camera.lens == LensModel::kPinhole) return Eigen::Matrix2d::Identity();
  Eigen::Matrix2d jacobian;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = kDistortionStepPx * Eigen::Vector2d::Unit(axis);
    const auto after = camera.Distort(camera.pinhole.Unproject(px + step));
    const auto before = camera.Distort(camera.pinhole.Unproject(px - step));
    if (!after || !before) return std::nullopt;
    jacobian.col(axis) = (*after - *before) / (2 * kDistortionStepPx);
  }
  return jacobian;
}

std::optional<Eigen::Matrix2d> PatchWarp(const SurfacePatch& patch_a, const SE3& b_from_a,
                                         const Camera& camera) {
  const auto plane = PlaneJacobian(patch_a, camera.pinhole);
  if (!plane) return std::nullopt;
  const Eigen::Vector3d point_b = b_from_a * patch_a.point_cam;
  const Eigen::Vector3d normal_b = b_from_a.rotation() * patch_a.normal_cam;
  if (!(point_b.z() > 0)) return std::nullopt;
  const double facing_a = patch_a.normal_cam.dot(patch_a.point_cam);
  const double facing_b = normal_b.dot(point_b);
  if (facing_a * facing_b <= 0 ||
      std::abs(facing_b) < kMinSineOfGrazing * normal_b.norm() * point_b.norm()) {
    return std::nullopt;
  }
  const auto lens_a = DistortionJacobian(camera, patch_a.px);
  const auto lens_b = DistortionJacobian(camera, camera.pinhole.Project(point_b));
  if (!lens_a || !lens_b) return std::nullopt;
  const Eigen::Matrix2d undistorted =
      camera.pinhole.ProjectJacobian(point_b) * b_from_a.RotationMatrix() * *plane;
  const Eigen::Matrix2d warp = *lens_b * undistorted * lens_a->inverse();
  if (!warp.allFinite()) return std::nullopt;
  return warp;
}

}  // namespace deepuav
