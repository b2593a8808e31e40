#pragma once

#include <Eigen/Core>
#include <cmath>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

using Matrix23d = Eigen::Matrix<double, 2, 3>;
using Matrix26d = Eigen::Matrix<double, 2, 6>;

/// Nearer than this to the plane of the camera's centre a point counts as behind it. World units:
/// maps have no metric scale, so it only keeps the division by the depth finite.
inline constexpr double kMinDepth = 1e-9;

inline bool InFrontOfCamera(const Eigen::Vector3d& point_cam) {
  return point_cam.z() > kMinDepth && point_cam.allFinite();
}

/// d pixel / d twist of `cam_from_world` multiplied from the left by Exp(twist), twist =
/// [translation; rotation], from d pixel / d point_cam: the point moves by translation + rotation x
/// point.
inline Matrix26d PoseJacobian(const Matrix23d& point_jacobian, const Eigen::Vector3d& point_cam) {
  Matrix26d jacobian;
  jacobian.leftCols<3>() = point_jacobian;
  for (int row = 0; row < 2; ++row) {
    jacobian.row(row).tail<3>() = point_cam.cross(point_jacobian.row(row).transpose()).transpose();
  }
  return jacobian;
}

/// The Huber loss as a function of the squared error, with the threshold squared (chi-square
/// bound).
struct HuberLoss {
  double squared_threshold;

  double Cost(double squared_error) const {
    if (squared_error <= squared_threshold) return squared_error;
    return 2 * std::sqrt(squared_error * squared_threshold) - squared_threshold;
  }
  /// d Cost / d squared_error: the weight of the observation in iteratively reweighted least
  /// squares.
  double Weight(double squared_error) const {
    return squared_error <= squared_threshold ? 1 : std::sqrt(squared_threshold / squared_error);
  }
};

}  // namespace deepuav
