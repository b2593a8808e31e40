#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace deepuav {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// The matrix of the cross product: Skew(a) * b = a x b.
Eigen::Matrix3d Skew(const Eigen::Vector3d& v);

/// Rotation by |v| radians about v, and back (angle in [0, pi]).
Eigen::Quaterniond RotationExp(const Eigen::Vector3d& rotation_vector);
Eigen::Vector3d RotationLog(const Eigen::Quaterniond& rotation);

/// The left Jacobian of SO(3).
Eigen::Matrix3d RotationLeftJacobian(const Eigen::Vector3d& rotation_vector);

/// A rigid transform, named `a_from_b`: p_a = a_from_b * p_b. Metres.
class SE3 {
 public:
  SE3() : rotation_(Eigen::Quaterniond::Identity()), translation_(Eigen::Vector3d::Zero()) {}
  SE3(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : rotation_(rotation.normalized()), translation_(translation) {}
  SE3(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation)
      : SE3(Eigen::Quaterniond(rotation), translation) {}

  /// Restores a saved pose to the bit: `unit_rotation` is what rotation() gave, and not normalised
  /// again.
  static SE3 FromUnit(const Eigen::Quaterniond& unit_rotation, const Eigen::Vector3d& translation) {
    SE3 pose;
    pose.rotation_ = unit_rotation;
    pose.translation_ = translation;
    return pose;
  }

  /// Exponential of the twist [translation part; rotation vector].
  static SE3 Exp(const Vector6d& twist);
  Vector6d Log() const;

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }
  Eigen::Matrix3d RotationMatrix() const { return rotation_.toRotationMatrix(); }
  Eigen::Matrix4d Matrix() const;

  SE3 Inverse() const;
  SE3 operator*(const SE3& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation_ * point + translation_;
  }

  /// Rotation angle, radians in [0, pi].
  double Angle() const { return RotationLog(rotation_).norm(); }

  /// For `a_from_b`: the origin of b in a is translation(); the origin of a in b is this.
  Eigen::Vector3d InverseTranslation() const { return -(rotation_.conjugate() * translation_); }

 private:
  Eigen::Quaterniond rotation_;
  Eigen::Vector3d translation_;
};

}  // namespace deepuav
