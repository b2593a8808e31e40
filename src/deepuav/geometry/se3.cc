#include "deepuav/geometry/se3.h"

#include <cmath>

namespace deepuav {
namespace {
constexpr double kSmallAngle = 1e-5;
}

Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

Eigen::Quaterniond RotationExp(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  const double half_sinc =
      angle < kSmallAngle ? 0.5 - angle * angle / 48 : std::sin(angle / 2) / angle;
  Eigen::Quaterniond q;
  q.w() = std::cos(angle / 2);
  q.vec() = half_sinc * rotation_vector;
  return q.normalized();
}

Eigen::Vector3d RotationLog(const Eigen::Quaterniond& rotation) {
  Eigen::Quaterniond q = rotation;
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  const double factor = sine < kSmallAngle ? 2 / q.w() : 2 * std::atan2(sine, q.w()) / sine;
  return factor * q.vec();
}

Eigen::Matrix3d RotationLeftJacobian(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  const Eigen::Matrix3d k = Skew(rotation_vector);
  if (angle < kSmallAngle) return Eigen::Matrix3d::Identity() + 0.5 * k + k * k / 6;
  const double squared = angle * angle;
  return Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / squared * k +
         (angle - std::sin(angle)) / (squared * angle) * k * k;
}

SE3 SE3::Exp(const Vector6d& twist) {
  const Eigen::Vector3d rotation_vector = twist.tail<3>();
  return SE3(RotationExp(rotation_vector), RotationLeftJacobian(rotation_vector) * twist.head<3>());
}

Vector6d SE3::Log() const {
  Vector6d twist;
  twist.tail<3>() = RotationLog(rotation_);
  twist.head<3>() = RotationLeftJacobian(twist.tail<3>()).lu().solve(translation_);
  return twist;
}

Eigen::Matrix4d SE3::Matrix() const {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = RotationMatrix();
  matrix.topRightCorner<3, 1>() = translation_;
  return matrix;
}

SE3 SE3::Inverse() const { return SE3(rotation_.conjugate(), InverseTranslation()); }

SE3 SE3::operator*(const SE3& other) const {
  return SE3(rotation_ * other.rotation_, rotation_ * other.translation_ + translation_);
}

}  // namespace deepuav
