#pragma once

#include "deepuav/geometry/se3.h"

namespace deepuav {

using Matrix7d = Eigen::Matrix<double, 7, 7>;

/// A similarity transform, named `a_from_b`: p_a = scale * rotation * p_b + translation.
class Sim3 {
 public:
  Sim3() = default;
  Sim3(double scale, const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : scale_(scale), rigid_(rotation, translation) {}
  explicit Sim3(const SE3& rigid, double scale = 1) : scale_(scale), rigid_(rigid) {}

  /// Exponential of the tangent [translation part; rotation vector; logarithm of the scale]
  /// (Strasdat 2012, "Local accuracy and global consistency for efficient visual SLAM", section
  /// 3.3), and back.
  static Sim3 Exp(const Vector7d& tangent);
  Vector7d Log() const;

  /// How tangents move: *this * Exp(tangent) * Inverse() = Exp(Adjoint() * tangent).
  Matrix7d Adjoint() const;

  double scale() const { return scale_; }
  const Eigen::Quaterniond& rotation() const { return rigid_.rotation(); }
  const Eigen::Vector3d& translation() const { return rigid_.translation(); }

  Sim3 Inverse() const;
  Sim3 operator*(const Sim3& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale_ * (rotation() * point) + translation();
  }

  /// The pose of a camera after its world moved by this transform `new_from_old`: given
  /// cam_from_old, the rigid cam_from_new whose translation is in the new world's scale.
  SE3 MovePose(const SE3& cam_from_old) const;

 private:
  double scale_ = 1;
  SE3 rigid_;
};

/// The inverse left Jacobian of Sim(3): Log(Exp(delta) * Exp(tangent)) = tangent +
/// Sim3LeftJacobianInverse(tangent) * delta to first order; the right one is that of -tangent. The
/// series of Bernoulli numbers is cut after the tenth power: relative error below 1e-7 for a
/// rotation and a logarithm of the scale of 1, about 1e-3 for a rotation of 3.
Matrix7d Sim3LeftJacobianInverse(const Vector7d& tangent);

}  // namespace deepuav
