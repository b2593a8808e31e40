#include "deepuav/tracking/motion_model.h"

#include <algorithm>
#include <utility>

#include "deepuav/base/option_check.h"

namespace deepuav {

void MotionOptions::Check() const { CheckOptions("tracking.motion", *this); }

MotionModel::MotionModel(const MotionOptions& options) : options_(options) { options_.Check(); }

void MotionModel::Reset() {
  last_cam_from_world_.reset();
  velocity_per_s_.reset();
  turned_.reset();
  is_lost_ = false;
}

void MotionModel::Turn(Timestamp time, const std::optional<Eigen::Quaterniond>& now_from_before) {
  if (turned_at_ && time <= *turned_at_) return;
  const Timestamp before = std::exchange(turned_at_, time).value_or(time);
  if (turned_ && now_from_before) {
    const Eigen::Quaterniond unbiased = RotationExp(-bias_rad_s_ * SecondsBetween(before, time));
    turned_ = (unbiased * *now_from_before * *turned_).normalized();
  } else {
    turned_.reset();
  }
}

void MotionModel::Update(Timestamp time, const SE3& cam_from_world) {
  const bool follows = last_cam_from_world_ && last_time_ < time && !is_lost_;
  if (follows) LearnFrom(time, cam_from_world);
  velocity_per_s_.reset();
  centre_velocity_per_s_.setZero();
  if (follows) {
    const SE3 now_from_before = cam_from_world * last_cam_from_world_->Inverse();
    const double passed_s = SecondsBetween(last_time_, time);
    velocity_per_s_ = now_from_before.Log() / passed_s;
    centre_velocity_per_s_ =
        -(cam_from_world * last_cam_from_world_->InverseTranslation()) / passed_s;
  }
  last_time_ = time;
  last_cam_from_world_ = cam_from_world;
  is_lost_ = false;
  turned_ = Eigen::Quaterniond::Identity();
}

void MotionModel::Lose() {
  is_lost_ = true;
  if (!turned_) Reset();
}

void MotionModel::Correct(const SE3& cam_from_world, double growth) {
  if (!last_cam_from_world_) return;
  last_cam_from_world_ = cam_from_world;
  if (velocity_per_s_) velocity_per_s_->head<3>() *= growth;
  centre_velocity_per_s_ *= growth;
}

std::optional<SE3> MotionModel::Predict(Timestamp time) const {
  if (!last_cam_from_world_) return std::nullopt;
  const std::optional<Eigen::Quaterniond> turned = TurnedUntil(time);
  if (!turned || !GyroscopeIsGood()) return is_lost_ ? std::nullopt : std::optional(Smooth(time));
  const Eigen::Vector3d moved = SecondsBetween(last_time_, time) * centre_velocity_per_s_;
  return SE3(*turned, -(*turned * moved)) * *last_cam_from_world_;
}

SE3 MotionModel::Smooth(Timestamp time) const {
  if (!velocity_per_s_) return *last_cam_from_world_;
  return SE3::Exp(*velocity_per_s_ * SecondsBetween(last_time_, time)) * *last_cam_from_world_;
}

std::optional<Eigen::Quaterniond> MotionModel::TurnedUntil(Timestamp time) const {
  if (!turned_ || turned_at_ != time) return std::nullopt;
  return turned_;
}

bool MotionModel::GyroscopeIsGood() const {
  return bias_rad_s_.norm() <= options_.max_gyroscope_bias_rad_s &&
         gyroscope_error_rad_s_ <= std::max(smooth_error_rad_s_, options_.fine_error_rad_s);
}

void MotionModel::LearnFrom(Timestamp time, const SE3& cam_from_world) {
  const std::optional<Eigen::Quaterniond> turned = TurnedUntil(time);
  if (!turned || !velocity_per_s_) return;
  const double passed_s = SecondsBetween(last_time_, time);
  const Eigen::Quaterniond truly =
      cam_from_world.rotation() * last_cam_from_world_->rotation().conjugate();
  Eigen::Vector3d missed_rad_s = RotationLog(*turned * truly.conjugate()) / passed_s;
  const double smooth_rad_s =
      RotationLog(Smooth(time).rotation() * cam_from_world.rotation().conjugate()).norm() /
      passed_s;
  const double gain = std::max(options_.error_gain, 1.0 / ++learnt_);
  gyroscope_error_rad_s_ += gain * (missed_rad_s.norm() - gyroscope_error_rad_s_);
  smooth_error_rad_s_ += gain * (smooth_rad_s - smooth_error_rad_s_);
  // A wrong pose does not spoil the mean.
  missed_rad_s *= std::min(1.0, options_.max_gyroscope_bias_rad_s / missed_rad_s.norm());
  bias_rad_s_ += std::max(options_.bias_gain, 1.0 / learnt_) * missed_rad_s;
}

}  // namespace deepuav
