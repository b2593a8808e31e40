#include "deepuav/geometry/sim3.h"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>

namespace deepuav {
namespace {

/// The integral over u in [0, 1] of exp(u (log_scale I + K)), K the cross product with the rotation
/// vector, for log_scale >= 0: the sum of (log_scale I + K)^n / (n + 1)!. As K^3 = -angle^2 K, each
/// power is identity * I + first * K + second * K^2. No small angle or scale needs a case of its
/// own.
Eigen::Matrix3d IntegralOfGrowth(double log_scale, const Eigen::Vector3d& rotation_vector) {
  const double squared_angle = rotation_vector.squaredNorm();
  double identity = 1, first = 0, second = 0;  // The term at hand, over (n + 1)!.
  double identity_sum = 1, first_sum = 0, second_sum = 0;
  constexpr int kMaxTerms = 1000;  // Only where the arguments are not finite.
  for (int n = 1; n < kMaxTerms; ++n) {
    const double next_identity = log_scale * identity;
    const double next_first = identity + log_scale * first - squared_angle * second;
    const double next_second = first + log_scale * second;
    const double divisor = 1.0 / (n + 1);
    identity = next_identity * divisor;
    first = next_first * divisor;
    second = next_second * divisor;
    identity_sum += identity;
    first_sum += first;
    second_sum += second;
    const double size = std::abs(identity) + std::abs(first) + std::abs(second);
    if (size < 0.01 * std::numeric_limits<double>::epsilon()) break;
  }
  const Eigen::Matrix3d k = Skew(rotation_vector);
  return identity_sum * Eigen::Matrix3d::Identity() + first_sum * k + second_sum * (k * k);
}

/// The matrix that takes the translation part of a tangent to the translation of its exponential.
Eigen::Matrix3d TranslationMatrix(double log_scale, const Eigen::Vector3d& rotation_vector) {
  if (log_scale >= 0) return IntegralOfGrowth(log_scale, rotation_vector);
  // The series of a shrinking exponential would lose digits: integrate it backwards.
  return std::exp(log_scale) * (RotationExp(rotation_vector).toRotationMatrix() *
                                IntegralOfGrowth(-log_scale, -rotation_vector));
}

}  // namespace

Sim3 Sim3::Exp(const Vector7d& tangent) {
  const Eigen::Vector3d rotation_vector = tangent.segment<3>(3);
  return Sim3(std::exp(tangent[6]), RotationExp(rotation_vector),
              TranslationMatrix(tangent[6], rotation_vector) * tangent.head<3>());
}

Vector7d Sim3::Log() const {
  const double log_scale = std::log(scale_);
  const Eigen::Vector3d rotation_vector = RotationLog(rotation());
  Vector7d tangent;
  tangent.head<3>() = TranslationMatrix(log_scale, rotation_vector).inverse() * translation();
  tangent.segment<3>(3) = rotation_vector;
  tangent[6] = log_scale;
  return tangent;
}

Matrix7d Sim3::Adjoint() const {
  const Eigen::Matrix3d matrix = rotation().toRotationMatrix();
  Matrix7d adjoint = Matrix7d::Zero();
  adjoint.block<3, 3>(0, 0) = scale_ * matrix;
  adjoint.block<3, 3>(0, 3) = Skew(translation()) * matrix;
  adjoint.block<3, 1>(0, 6) = -translation();
  adjoint.block<3, 3>(3, 3) = matrix;
  adjoint(6, 6) = 1;
  return adjoint;
}

Sim3 Sim3::Inverse() const {
  const Eigen::Quaterniond inverse = rotation().conjugate();
  return Sim3(1 / scale_, inverse, -(inverse * translation()) / scale_);
}

Sim3 Sim3::operator*(const Sim3& other) const {
  return Sim3(scale_ * other.scale_, rotation() * other.rotation(), *this * other.translation());
}

SE3 Sim3::MovePose(const SE3& cam_from_old) const {
  const Eigen::Quaterniond cam_from_new = cam_from_old.rotation() * rotation().conjugate();
  const Eigen::Vector3d centre_new = *this * cam_from_old.InverseTranslation();
  return SE3(cam_from_new, -(cam_from_new * centre_new));
}

Matrix7d Sim3LeftJacobianInverse(const Vector7d& tangent) {
  // B_2 / 2! ... B_10 / 10!, B the Bernoulli numbers.
  constexpr std::array<double, 5> kSeries = {1.0 / 12, -1.0 / 720, 1.0 / 30240, -1.0 / 1209600,
                                             1.0 / 47900160};
  const Eigen::Matrix3d rotation = Skew(tangent.segment<3>(3));
  Matrix7d bracket = Matrix7d::Zero();  // bracket * other = [tangent, other] of the Lie algebra.
  bracket.block<3, 3>(0, 0) = rotation;
  bracket.diagonal().head<3>().setConstant(tangent[6]);
  bracket.block<3, 3>(0, 3) = Skew(tangent.head<3>());
  bracket.block<3, 1>(0, 6) = -tangent.head<3>();
  bracket.block<3, 3>(3, 3) = rotation;
  const Matrix7d square = bracket.lazyProduct(bracket);
  Matrix7d even = kSeries.back() * square;
  for (size_t i = kSeries.size() - 1; i-- > 0;) {
    even.diagonal().array() += kSeries[i];
    even = square.lazyProduct(even).eval();
  }
  even -= 0.5 * bracket;
  even.diagonal().array() += 1;
  return even;
}

}  // namespace deepuav
