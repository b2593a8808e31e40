#include "deepuav/estimation/two_views/two_view_certainty.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "deepuav/base/median.h"
#include "deepuav/estimation/poses/reprojection.h"

namespace deepuav {
namespace {

using Matrix63d = Eigen::Matrix<double, 6, 3>;

/// Of the least and the most certain direction of a point, so that points at infinity can be
/// inverted.
constexpr double kLeastInformationRatio = 1e-12;
/// Weight of the condition that the baseline keeps its length, over the rest's.
constexpr double kFixed = 1e6;
/// Of |normal error|: its median over the standard deviation.
constexpr double kMedianOfNormal = 0.6745;

Matrix23d PointJacobian(const Pinhole& pinhole, const Eigen::Vector3d& point_cam) {
  const double inv_z = 1 / point_cam.z();
  Matrix23d jacobian;
  jacobian << pinhole.fx * inv_z, 0, -pinhole.fx * point_cam.x() * inv_z * inv_z, 0,
      pinhole.fy * inv_z, -pinhole.fy * point_cam.y() * inv_z * inv_z;
  return jacobian;
}

/// What the pixels of one point say of it and of camera b, for errors of a pixel at a noise ratio
/// of 1.
struct PointEquations {
  Eigen::Matrix3d covariance;  ///< With camera b where it is.
  Matrix63d coupling;          ///< Of camera b's twist with the point.
  Matrix6d of_camera;

  PointEquations(const Pinhole& pinhole, const SE3& b_from_a, const Eigen::Vector3d& point_a,
                 double noise_ratio) {
    const double weight = 1 / (noise_ratio * noise_ratio);
    const Eigen::Vector3d point_b = b_from_a * point_a;
    const Matrix23d in_a = PointJacobian(pinhole, point_a);
    const Matrix23d in_b_cam = PointJacobian(pinhole, point_b);
    const Matrix23d in_b = in_b_cam * b_from_a.RotationMatrix();
    const Matrix26d camera = PoseJacobian(in_b_cam, point_b);
    Eigen::Matrix3d information = in_a.transpose() * in_a + in_b.transpose() * in_b;
    information.diagonal().array() += kLeastInformationRatio * information.trace();
    covariance = information.inverse() / weight;
    coupling = weight * camera.transpose() * in_b;
    of_camera = weight * camera.transpose() * camera;
  }
};

}  // namespace

std::vector<double> RelativeDistanceSigmas(const Pinhole& pinhole,
                                           const std::vector<PixelPair>& pairs,
                                           const TwoViewSolution& solution, double sigma_px) {
  std::vector<double> sigmas(solution.points_a.size(), std::numeric_limits<double>::infinity());
  const SE3& b_from_a = solution.b_from_a;
  Matrix6d information = Matrix6d::Zero();
  for (size_t i = 0; i < sigmas.size(); ++i) {
    if (!solution.valid[i]) continue;
    const PointEquations point(pinhole, b_from_a, solution.points_a[i], pairs[i].noise_ratio);
    information += point.of_camera - point.coupling * point.covariance * point.coupling.transpose();
  }
  Vector6d along_baseline = Vector6d::Zero();
  along_baseline.head<3>() = b_from_a.translation().normalized();
  information += kFixed * information.trace() * along_baseline * along_baseline.transpose();
  const Eigen::LDLT<Matrix6d> factored(information);
  if (factored.info() != Eigen::Success || !factored.isPositive()) return sigmas;
  for (size_t i = 0; i < sigmas.size(); ++i) {
    if (!solution.valid[i]) continue;
    const Eigen::Vector3d& point_a = solution.points_a[i];
    const PointEquations point(pinhole, b_from_a, point_a, pairs[i].noise_ratio);
    const Eigen::Vector3d direction = point_a.normalized();
    const Vector6d by_camera = point.coupling * (point.covariance * direction);
    const double variance =
        direction.dot(point.covariance * direction) + by_camera.dot(factored.solve(by_camera));
    if (variance >= 0) sigmas[i] = sigma_px * std::sqrt(variance) / point_a.norm();
  }
  return sigmas;
}

double EpipolarSigmaPx(const Pinhole& pinhole, const std::vector<PixelPair>& pairs,
                       const TwoViewSolution& solution, double least_px) {
  const Eigen::Vector3d baseline = solution.b_from_a.translation();
  const Eigen::Matrix3d rotation = solution.b_from_a.RotationMatrix();
  const Eigen::Vector2d per_px(1 / pinhole.fx, 1 / pinhole.fy);
  std::vector<double> errors_px;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (!solution.valid[i]) continue;
    const Eigen::Vector3d ray_a = pinhole.Unproject(pairs[i].a_px);
    const Eigen::Vector3d ray_b = pinhole.Unproject(pairs[i].b_px);
    const Eigen::Vector3d line_b = baseline.cross(rotation * ray_a);
    const Eigen::Vector3d line_a = -(rotation.transpose() * baseline.cross(ray_b));
    const double gradient = std::hypot(line_a.head<2>().cwiseProduct(per_px).norm(),
                                       line_b.head<2>().cwiseProduct(per_px).norm());
    if (gradient > 0)
      errors_px.push_back(std::abs(ray_b.dot(line_b)) / (gradient * pairs[i].noise_ratio));
  }
  if (errors_px.empty()) return least_px;
  return std::max(least_px, Median(errors_px) / kMedianOfNormal);
}

}  // namespace deepuav
