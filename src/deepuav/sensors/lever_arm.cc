#include "deepuav/sensors/lever_arm.h"

#include <Eigen/Cholesky>

namespace deepuav {
namespace {

constexpr int kMaxIterations = 50;
constexpr double kConverged = 1e-12;  // Of the step: radians, and metres and scale relative to 1.

using Jacobian = Eigen::Matrix<double, 3, 7>;  // By turn, shift, logarithm of scale.

/// What the kind of alignment leaves free.
Vector7d FreeParameters(AlignmentKind kind) {
  Vector7d free = Vector7d::Ones();
  if (kind != AlignmentKind::kSimilar) free[6] = 0;
  if (kind == AlignmentKind::kYaw) free[0] = free[1] = 0;
  return free;
}

Vector7d GaussNewtonStep(const Trajectory& truth, const Trajectory& estimate, const Sim3& current,
                         AlignmentKind kind, const Eigen::Vector3d& antenna_cam_m) {
  const Vector7d free = FreeParameters(kind);
  Eigen::Matrix<double, 7, 7> normal = Eigen::Matrix<double, 7, 7>::Zero();
  Vector7d gradient = Vector7d::Zero();
  for (size_t i = 0; i < truth.size(); ++i) {
    const SE3& pose = estimate[i].world_from_cam;
    const Eigen::Vector3d path = current.scale() * (current.rotation() * pose.translation());
    const Eigen::Vector3d arm = current.rotation() * (pose.rotation() * antenna_cam_m);
    Jacobian jacobian;
    jacobian << -Skew(path + arm), Eigen::Matrix3d::Identity(), path;
    jacobian = jacobian * free.asDiagonal();
    const Eigen::Vector3d residual =
        path + current.translation() + arm - truth[i].world_from_cam.translation();
    normal += jacobian.transpose() * jacobian;
    gradient += jacobian.transpose() * residual;
  }
  normal.diagonal() += Vector7d::Ones() - free;
  return -normal.ldlt().solve(gradient);
}

}  // namespace

std::optional<Sim3> AlignWithLeverArm(const Trajectory& truth, const Trajectory& estimate,
                                      AlignmentKind kind, const Eigen::Vector3d& antenna_cam_m) {
  std::optional<Sim3> aligned = Align(Positions(estimate), Positions(truth), kind);
  if (!aligned || antenna_cam_m.isZero()) return aligned;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Vector7d step = GaussNewtonStep(truth, estimate, *aligned, kind, antenna_cam_m);
    if (!step.allFinite()) return std::nullopt;
    aligned = Sim3(aligned->scale() * std::exp(step[6]),
                   RotationExp(step.head<3>()) * aligned->rotation(),
                   aligned->translation() + step.segment<3>(3));
    if (step.norm() < kConverged) break;
  }
  return aligned;
}

Trajectory MoveToAntenna(const Sim3& new_from_old, const Trajectory& trajectory,
                         const Eigen::Vector3d& antenna_cam_m) {
  Trajectory moved = MoveTrajectory(new_from_old, trajectory);
  if (antenna_cam_m.isZero()) return moved;
  for (TimedPose& pose : moved) {
    pose.world_from_cam = SE3(pose.world_from_cam.rotation(), pose.world_from_cam * antenna_cam_m);
  }
  return moved;
}

}  // namespace deepuav
