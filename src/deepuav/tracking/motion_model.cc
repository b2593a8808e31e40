#include "deepuav/tracking/motion_model.h"

namespace deepuav {

void MotionModel::Update(Timestamp time, const SE3& cam_from_world) {
  velocity_per_s_.reset();
  if (last_cam_from_world_ && last_time_ < time) {
    const SE3 now_from_before = cam_from_world * last_cam_from_world_->Inverse();
    velocity_per_s_ = now_from_before.Log() / SecondsBetween(last_time_, time);
  }
  last_time_ = time;
  last_cam_from_world_ = cam_from_world;
}

void MotionModel::Correct(const SE3& cam_from_world, double growth) {
  if (!last_cam_from_world_) return;
  last_cam_from_world_ = cam_from_world;
  if (velocity_per_s_) velocity_per_s_->head<3>() *= growth;
}

std::optional<SE3> MotionModel::Predict(Timestamp time) const {
  if (!last_cam_from_world_ || !velocity_per_s_) return last_cam_from_world_;
  return SE3::Exp(*velocity_per_s_ * SecondsBetween(last_time_, time)) * *last_cam_from_world_;
}

}  // namespace deepuav
