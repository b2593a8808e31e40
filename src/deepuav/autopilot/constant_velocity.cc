#include "deepuav/autopilot/constant_velocity.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace deepuav {
namespace {

double SecondsFrom(int64_t from_ns, int64_t to_ns) {
  return 1e-9 * static_cast<double>(to_ns - from_ns);
}

}  // namespace

BodyMotion ConstantVelocity::Predicted(int64_t time_ns) const {
  const double dt_s = SecondsFrom(time_ns_, time_ns);
  BodyMotion motion = motion_;
  motion.local_from_body =
      SE3(motion_.local_from_body.rotation() * RotationExp(dt_s * motion_.turn_rate_body),
          motion_.local_from_body.translation() + dt_s * motion_.velocity_local);
  Matrix12d transition = Matrix12d::Identity();
  transition.topRightCorner<6, 6>() = dt_s * Matrix6d::Identity();
  const Matrix6d density = DiagonalOf(options_.acceleration_density, options_.turn_density);
  const double dt = std::abs(dt_s);
  Matrix12d noise;
  noise << dt * dt * dt / 3 * density, dt * dt / 2 * density, dt * dt / 2 * density, dt * density;
  motion.covariance = transition * motion_.covariance * transition.transpose() + noise;
  return motion;
}

void ConstantVelocity::Begin(int64_t time_ns, const BodyPose& pose) {
  time_ns_ = time_ns;
  poses_ = 1;
  motion_ = {};
  motion_.local_from_body = pose.local_from_body;
  motion_.covariance.setZero();
  motion_.covariance.topLeftCorner<6, 6>() = NoiseOf(pose, options_.trust);
  motion_.covariance.bottomRightCorner<6, 6>() =
      DiagonalOf(options_.velocity_sigma_m_s, options_.turn_rate_sigma_rad_s);
  motion_.covariance_is_known = pose.covariance_is_known;
}

bool ConstantVelocity::Expects(int64_t time_ns, const BodyPose& pose) const {
  if (poses_ < 2) return true;
  const BodyMotion motion = Predicted(time_ns);
  const Vector6d residual = PoseResidual(motion.local_from_body, pose.local_from_body);
  const Matrix6d covariance =
      motion.covariance.topLeftCorner<6, 6>() + NoiseOf(pose, options_.trust);
  return residual.dot(covariance.llt().solve(residual)) <= options_.max_chi_square;
}

void ConstantVelocity::Add(int64_t time_ns, const BodyPose& pose) {
  if (poses_ == 0) return Begin(time_ns, pose);
  if (time_ns <= time_ns_) return;
  motion_ = Predicted(time_ns);
  time_ns_ = time_ns;
  ++poses_;
  const SE3& predicted = motion_.local_from_body;
  const PoseUpdate<12> update(motion_.covariance, NoiseOf(pose, options_.trust));
  const Eigen::Matrix<double, 12, 1> step =
      update.gain * PoseResidual(predicted, pose.local_from_body);
  motion_.local_from_body = MovedBy(predicted, step.head<6>());
  motion_.velocity_local += step.segment<3>(6);
  motion_.turn_rate_body += step.tail<3>();
  motion_.covariance = update.posterior;
  motion_.covariance_is_known = pose.covariance_is_known;
}

void ConstantVelocity::Jump(int64_t time_ns, const BodyPose& pose) {
  if (poses_ < 2 || time_ns <= time_ns_) return Begin(time_ns, pose);
  const BodyMotion before = Predicted(time_ns);
  const int poses = poses_;
  Begin(time_ns, pose);
  poses_ = poses;
  const Eigen::Quaterniond turn =
      pose.local_from_body.rotation() * before.local_from_body.rotation().conjugate();
  motion_.velocity_local = turn * before.velocity_local;
  motion_.turn_rate_body = before.turn_rate_body;
  Matrix6d axes = Matrix6d::Identity();
  axes.topLeftCorner<3, 3>() = turn.toRotationMatrix();
  motion_.covariance.bottomRightCorner<6, 6>() =
      axes * before.covariance.bottomRightCorner<6, 6>() * axes.transpose();
}

std::optional<BodyMotion> ConstantVelocity::At(int64_t time_ns) const {
  if (poses_ < 2) return std::nullopt;
  return Predicted(time_ns);
}

}  // namespace deepuav
