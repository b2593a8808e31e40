#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/time.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// How far a gyroscope is followed.
struct MotionOptions {
  double bias_gain = 0.05;  ///< Weight of the newest turn in the mean of what the gyroscope misses.
  double error_gain = 0.2;  ///< The same in the mean errors of both predictions.
  double max_gyroscope_bias_rad_s = 0.2;  ///< A gyroscope that misses more in the mean is wrong.
  double fine_error_rad_s = 0.05;         ///< Mean error with which it is followed in any case.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("bias_gain", bias_gain, "",
          "weight of the newest turn in the mean of what a gyroscope misses", Above(0, 1));
    visit("error_gain", error_gain, "",
          "weight of the newest turn in the mean errors of predictions with and without it",
          Above(0, 1));
    visit("max_gyroscope_bias_rad_s", max_gyroscope_bias_rad_s, "rad/s",
          "what a gyroscope may miss in the mean", Above(0, 100));
    visit("fine_error_rad_s", fine_error_rad_s, "rad/s",
          "mean error with which a gyroscope is followed even where constant velocity errs by less",
          Between(0, 100));
  }
};

/// Constant velocity between two frames, in the camera's own frame. Where a gyroscope says how the
/// camera turned, and has said it well so far, its turn, and constant velocity in the world.
class MotionModel {
 public:
  explicit MotionModel(const MotionOptions& options = {});

  /// Forgets the poses, not what is known of the gyroscope.
  void Reset();

  /// A frame has come, turned since the one before by `now_from_before` where a gyroscope measured
  /// that. A frame that has come already is not counted again.
  void Turn(Timestamp time, const std::optional<Eigen::Quaterniond>& now_from_before);

  /// Takes the pose of the newest tracked frame.
  void Update(Timestamp time, const SE3& cam_from_world);

  /// The newest frame has no pose: from here on only a gyroscope carries the last one on.
  void Lose();

  /// The newest pose, if there is one, was corrected, and all lengths grew by `growth`; the
  /// velocity stays but for that.
  void Correct(const SE3& cam_from_world, double growth = 1);

  /// The pose at `time`; the newest pose where no velocity is known yet; nothing before the first
  /// Update, or once it was lost and no gyroscope told all turns since.
  std::optional<SE3> Predict(Timestamp time) const;

  /// Whether what it predicts is carried on from before frames without a pose.
  bool is_lost() const { return is_lost_; }
  /// Nothing before the first Update.
  const std::optional<SE3>& last_cam_from_world() const { return last_cam_from_world_; }
  Timestamp last_time() const { return last_time_; }

 private:
  SE3 Smooth(Timestamp time) const;
  /// How the camera turned since the last pose; nothing where it is not known.
  std::optional<Eigen::Quaterniond> TurnedUntil(Timestamp time) const;
  bool GyroscopeIsGood() const;
  void LearnFrom(Timestamp time, const SE3& cam_from_world);

  const MotionOptions options_;
  Timestamp last_time_;
  std::optional<SE3> last_cam_from_world_;
  std::optional<Vector6d> velocity_per_s_;  ///< Log of now_from_before over the time between them.
  Eigen::Vector3d centre_velocity_per_s_ = Eigen::Vector3d::Zero();  ///< In the last pose's axes.
  bool is_lost_ = false;
  std::optional<Eigen::Quaterniond> turned_;  ///< Since the last pose, without the bias...
  std::optional<Timestamp> turned_at_;        ///< ...until the frame of this time.
  Eigen::Vector3d bias_rad_s_ = Eigen::Vector3d::Zero();
  int learnt_ = 0;  ///< Turns that it was compared with.
  double gyroscope_error_rad_s_ = 0, smooth_error_rad_s_ = 0;
};

}  // namespace deepuav
