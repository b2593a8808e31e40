#pragma once

#include <Eigen/Core>
#include <cmath>

#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "deepuav/estimation/poses/reprojection.h"

namespace deepuav {

/// The calibration parameters that bundle adjustment can refine, in the order of its shared block.
enum CalibrationParameter {
  kFocalScale,
  kRadial1,
  kRadial2,
  kCentreX,
  kCentreY,
  kTangential1,
  kTangential2,
  kReadout,
  kCalibrationParameters
};

using VectorCalibration = Eigen::Matrix<double, kCalibrationParameters, 1>;
using Matrix2Calibration = Eigen::Matrix<double, 2, kCalibrationParameters>;

/// Pinhole with the distortion of Camera's radial-tangential model, of two radial coefficients, and
/// a shutter that reads one row after the other.
struct BundleCamera {
  Pinhole pinhole;
  double k1 = 0, k2 = 0;
  double p1 = 0, p2 = 0;
  double readout_s = 0;  ///< From the first row to the last.

  Eigen::Vector2d Project(const Eigen::Vector3d& point_cam) const {
    const double x = point_cam.x() / point_cam.z(), y = point_cam.y() / point_cam.z();
    const double squared = x * x + y * y;
    const double radial = 1 + squared * (k1 + squared * k2);
    return {pinhole.fx * (radial * x + 2 * p1 * x * y + p2 * (squared + 2 * x * x)) + pinhole.cx,
            pinhole.fy * (radial * y + p1 * (squared + 2 * y * y) + 2 * p2 * x * y) + pinhole.cy};
  }

  /// d Project / d point_cam.
  Matrix23d PointJacobian(const Eigen::Vector3d& point_cam) const {
    const double inv_z = 1 / point_cam.z();
    const double x = point_cam.x() * inv_z, y = point_cam.y() * inv_z;
    const double squared = x * x + y * y;
    const double radial = 1 + squared * (k1 + squared * k2);
    const double slope = 2 * (k1 + 2 * squared * k2);  // d radial / d squared, doubled.
    const double mixed = slope * x * y + 2 * (p1 * x + p2 * y);
    const double u_x = pinhole.fx * (radial + slope * x * x + 2 * p1 * y + 6 * p2 * x);
    const double u_y = pinhole.fx * mixed, v_x = pinhole.fy * mixed;
    const double v_y = pinhole.fy * (radial + slope * y * y + 6 * p1 * y + 2 * p2 * x);
    Matrix23d jacobian;
    jacobian << u_x * inv_z, u_y * inv_z, -(u_x * x + u_y * y) * inv_z,  //
        v_x * inv_z, v_y * inv_z, -(v_x * x + v_y * y) * inv_z;
    return jacobian;
  }

  /// d Project / d calibration but for the readout, which moves the point; the focal parameter s
  /// scales fx and fy by exp(s), and the centre moves by shares of fx.
  Matrix2Calibration CalibrationJacobian(const Eigen::Vector3d& point_cam) const {
    const double x = point_cam.x() / point_cam.z(), y = point_cam.y() / point_cam.z();
    const double squared = x * x + y * y;
    const Eigen::Vector2d focal_ray(pinhole.fx * x, pinhole.fy * y);
    Matrix2Calibration jacobian = Matrix2Calibration::Zero();
    jacobian.col(kFocalScale) = Project(point_cam) - Eigen::Vector2d(pinhole.cx, pinhole.cy);
    jacobian.col(kRadial1) = squared * focal_ray;
    jacobian.col(kRadial2) = squared * squared * focal_ray;
    jacobian(0, kCentreX) = jacobian(1, kCentreY) = pinhole.fx;
    jacobian.col(kTangential1) << pinhole.fx * 2 * x * y, pinhole.fy * (squared + 2 * y * y);
    jacobian.col(kTangential2) << pinhole.fx * (squared + 2 * x * x), pinhole.fy * 2 * x * y;
    return jacobian;
  }

  bool IsUndistorted() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0; }

  BundleCamera Moved(const VectorCalibration& step) const {
    BundleCamera moved = *this;
    moved.pinhole.fx *= std::exp(step[kFocalScale]);
    moved.pinhole.fy *= std::exp(step[kFocalScale]);
    moved.k1 += step[kRadial1];
    moved.k2 += step[kRadial2];
    moved.pinhole.cx += pinhole.fx * step[kCentreX];
    moved.pinhole.cy += pinhole.fx * step[kCentreY];
    moved.p1 += step[kTangential1];
    moved.p2 += step[kTangential2];
    moved.readout_s += step[kReadout];
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
