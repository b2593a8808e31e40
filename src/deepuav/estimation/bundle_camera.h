#pragma once

#include <Eigen/Core>
#include <cmath>

#include "deepuav/estimation/bundle_adjustment.h"
#include "deepuav/estimation/reprojection.h"

namespace deepuav {

/// The calibration parameters that bundle adjustment can refine, in the order of its shared block.
enum CalibrationParameter { kFocalScale, kRadial1, kRadial2, kCalibrationParameters };

using Vector3dCalibration = Eigen::Matrix<double, kCalibrationParameters, 1>;
using Matrix23dCalibration = Eigen::Matrix<double, 2, kCalibrationParameters>;

/// Pinhole with radial distortion: px = centre + f (1 + k1 r^2 + k2 r^4) (x/z, y/z).
struct BundleCamera {
  Pinhole pinhole;
  double k1 = 0, k2 = 0;

  Eigen::Vector2d Project(const Eigen::Vector3d& point_cam) const {
    const double x = point_cam.x() / point_cam.z(), y = point_cam.y() / point_cam.z();
    const double squared = x * x + y * y;
    const double radial = 1 + squared * (k1 + squared * k2);
    return {pinhole.fx * radial * x + pinhole.cx, pinhole.fy * radial * y + pinhole.cy};
  }

  /// d Project / d point_cam.
  Matrix23d PointJacobian(const Eigen::Vector3d& point_cam) const {
    const double inv_z = 1 / point_cam.z();
    const double x = point_cam.x() * inv_z, y = point_cam.y() * inv_z;
    const double squared = x * x + y * y;
    const double radial = 1 + squared * (k1 + squared * k2);
    const double slope = 2 * (k1 + 2 * squared * k2);  // d radial / d squared, doubled.
    const double u_x = pinhole.fx * (radial + slope * x * x), u_y = pinhole.fx * slope * x * y;
    const double v_x = pinhole.fy * slope * x * y, v_y = pinhole.fy * (radial + slope * y * y);
    Matrix23d jacobian;
    jacobian << u_x * inv_z, u_y * inv_z, -(u_x * x + u_y * y) * inv_z,  //
        v_x * inv_z, v_y * inv_z, -(v_x * x + v_y * y) * inv_z;
    return jacobian;
  }

  /// d Project / d calibration; the focal parameter s scales fx and fy by exp(s).
  Matrix23dCalibration CalibrationJacobian(const Eigen::Vector3d& point_cam) const {
    const double x = point_cam.x() / point_cam.z(), y = point_cam.y() / point_cam.z();
    const double squared = x * x + y * y;
    const double radial = 1 + squared * (k1 + squared * k2);
    const Eigen::Vector2d focal_ray(pinhole.fx * x, pinhole.fy * y);
    Matrix23dCalibration jacobian;
    jacobian.col(kFocalScale) = radial * focal_ray;
    jacobian.col(kRadial1) = squared * focal_ray;
    jacobian.col(kRadial2) = squared * squared * focal_ray;
    return jacobian;
  }

  BundleCamera Moved(const Vector3dCalibration& step) const {
    BundleCamera moved = *this;
    moved.pinhole.fx *= std::exp(step[kFocalScale]);
    moved.pinhole.fy *= std::exp(step[kFocalScale]);
    moved.k1 += step[kRadial1];
    moved.k2 += step[kRadial2];
    return moved;
  }
};

/// What bundle adjustment moves.
struct BundleState {
  BundleCamera camera;
  std::vector<SE3> cam_from_world;
  std::vector<Eigen::Vector3d> landmarks_world;
};

}  // namespace deepuav
