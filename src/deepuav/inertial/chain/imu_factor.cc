#include "deepuav/inertial/chain/imu_factor.h"

#include <Eigen/LU>
#include <cmath>

namespace deepuav {

ImuResidual ResidualOf(const InertialState& first, const InertialState& last,
                       const Preintegration& motion, const Eigen::Vector3d& camera_in_imu_m,
                       double gravity_m_s2) {
  const double seconds = motion.duration_s, half_square = 0.5 * seconds * seconds;
  const double scale = std::exp(first.log_scale);
  const Eigen::Matrix3d imu_from_world = first.world_from_imu.toRotationMatrix().transpose();
  const Eigen::Matrix3d first_from_last = imu_from_world * last.world_from_imu.toRotationMatrix();
  const Eigen::Vector3d moved_m = scale * (last.camera - first.camera);
  const Eigen::Vector3d gravity = gravity_m_s2 * first.down;
  const Eigen::Vector3d speeded =
      imu_from_world * (last.velocity_m_s - first.velocity_m_s - seconds * gravity);
  const Eigen::Vector3d carried =
      imu_from_world * (moved_m - seconds * first.velocity_m_s - half_square * gravity);

  ImuResidual residual;
  const Eigen::Vector3d turned = RotationLog(
      motion.rotation.conjugate() * first.world_from_imu.conjugate() * last.world_from_imu);
  residual.value.segment<3>(kTurned) = turned;
  residual.value.segment<3>(kSpeeded) = speeded - motion.velocity_m_s;
  residual.value.segment<3>(kMoved) =
      carried - first_from_last * camera_in_imu_m + camera_in_imu_m - motion.position_m;

  const Eigen::Matrix3d by_right = RotationLeftJacobian(-turned).inverse();
  auto& a = residual.by_first;
  auto& b = residual.by_last;
  a.setZero();
  b.setZero();
  a.block<3, 3>(kTurned, kRotation) = -by_right * first_from_last.transpose();
  b.block<3, 3>(kTurned, kRotation) = by_right;
  a.block<3, 3>(kTurned, kGyroscopeBias) =
      -RotationLeftJacobian(turned).inverse() * motion.by_bias.block<3, 3>(kTurned, 0);

  a.block<3, 3>(kSpeeded, kRotation) = Skew(speeded);
  a.block<3, 3>(kSpeeded, kVelocity) = -imu_from_world;
  b.block<3, 3>(kSpeeded, kVelocity) = imu_from_world;
  a.block<6, 6>(kSpeeded, kGyroscopeBias) = -motion.by_bias.bottomRows<6>();

  const Eigen::Matrix3d lever = first_from_last * Skew(camera_in_imu_m);
  a.block<3, 3>(kMoved, kRotation) = Skew(carried - first_from_last * camera_in_imu_m);
  b.block<3, 3>(kMoved, kRotation) = lever;
  a.block<3, 3>(kMoved, kPosition) = -scale * imu_from_world;
  b.block<3, 3>(kMoved, kPosition) = scale * imu_from_world;
  a.block<3, 3>(kMoved, kVelocity) = -seconds * imu_from_world;
  a.block<3, 1>(kMoved, kLogScaleOfMap) = imu_from_world * moved_m;

  const Eigen::Matrix<double, 3, 2> by_down =
      gravity_m_s2 * imu_from_world * AxesAcross(first.down);
  a.block<3, 2>(kSpeeded, kDown) = -seconds * by_down;
  a.block<3, 2>(kMoved, kDown) = -half_square * by_down;
  return residual;
}

}  // namespace deepuav
