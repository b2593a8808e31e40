#include "deepuav/geometry/triangulation.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace deepuav {

std::optional<Eigen::Vector3d> TriangulatePoint(const SE3& a_from_world,
                                                const Eigen::Vector3d& ray_a,
                                                const SE3& b_from_world,
                                                const Eigen::Vector3d& ray_b) {
  const Eigen::Matrix<double, 3, 4> a = a_from_world.Matrix().topRows<3>();
  const Eigen::Matrix<double, 3, 4> b = b_from_world.Matrix().topRows<3>();
  Eigen::Matrix4d design;
  design.row(0) = ray_a.x() * a.row(2) - ray_a.z() * a.row(0);
  design.row(1) = ray_a.y() * a.row(2) - ray_a.z() * a.row(1);
  design.row(2) = ray_b.x() * b.row(2) - ray_b.z() * b.row(0);
  design.row(3) = ray_b.y() * b.row(2) - ray_b.z() * b.row(1);
  const Eigen::JacobiSVD<Eigen::Matrix4d> svd(design, Eigen::ComputeFullV);
  const Eigen::Vector4d point = svd.matrixV().col(3);
  if (std::abs(point.w()) < 1e-9) return std::nullopt;
  return point.head<3>() / point.w();
}

double ParallaxAngle(const Eigen::Vector3d& centre_a, const Eigen::Vector3d& centre_b,
                     const Eigen::Vector3d& point) {
  const Eigen::Vector3d to_a = (centre_a - point).normalized();
  const Eigen::Vector3d to_b = (centre_b - point).normalized();
  return std::atan2(to_a.cross(to_b).norm(), to_a.dot(to_b));
}

}  // namespace deepuav
