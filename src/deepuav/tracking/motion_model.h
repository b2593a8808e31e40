#pragma once

#include <optional>

#include "deepuav/base/time.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// Constant velocity between two frames, in the camera's own frame.
class MotionModel {
 public:
  void Reset() { *this = MotionModel(); }

  /// Takes the pose of the newest tracked frame.
  void Update(Timestamp time, const SE3& cam_from_world);

  /// The newest pose, if there is one, was corrected, and all lengths grew by `growth`; the
  /// velocity stays but for that.
  void Correct(const SE3& cam_from_world, double growth = 1);

  /// The pose at `time`; the newest pose where no velocity is known yet; nothing before the first
  /// Update.
  std::optional<SE3> Predict(Timestamp time) const;

  /// Nothing before the first Update.
  const std::optional<SE3>& last_cam_from_world() const { return last_cam_from_world_; }
  Timestamp last_time() const { return last_time_; }

 private:
  Timestamp last_time_;
  std::optional<SE3> last_cam_from_world_;
  std::optional<Vector6d> velocity_per_s_;  ///< Log of now_from_before over the time between them.
};

}  // namespace deepuav
