#include "deepuav/autopilot/pose_noise.h"

namespace deepuav {

Matrix6d DiagonalOf(double linear_sigma, double angular_sigma) {
  Vector6d diagonal;
  diagonal << Eigen::Vector3d::Constant(linear_sigma * linear_sigma),
      Eigen::Vector3d::Constant(angular_sigma * angular_sigma);
  return diagonal.asDiagonal();
}

Matrix6d NoiseOf(const BodyPose& pose, const PoseTrust& trust) {
  if (!pose.covariance_is_known)
    return DiagonalOf(trust.unknown_position_sigma_m, trust.unknown_rotation_sigma_rad);
  return pose.covariance + DiagonalOf(trust.least_position_sigma_m, trust.least_rotation_sigma_rad);
}

Vector6d PoseResidual(const SE3& predicted, const SE3& found) {
  Vector6d residual;
  residual << found.translation() - predicted.translation(),
      RotationLog(predicted.rotation().conjugate() * found.rotation());
  return residual;
}

SE3 MovedBy(const SE3& pose, const Vector6d& step) {
  return {pose.rotation() * RotationExp(step.tail<3>()), pose.translation() + step.head<3>()};
}

}  // namespace deepuav
