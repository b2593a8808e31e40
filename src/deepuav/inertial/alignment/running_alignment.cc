#include "deepuav/inertial/alignment/running_alignment.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

/// By how much surer what is found must be to be told anew, and how many standard deviations away
/// from what was told.
constexpr double kSurer = 2, kContradiction = 3;

/// A map's world starts as its first camera.
Sim3 LevelWorld(const Sim3& level_from_world) {
  const Eigen::Vector3d up = level_from_world.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  return LevelByFirstCamera(SE3(), up, level_from_world.scale());
}

/// What clocks may be apart: the path may need samples so far beyond its ends.
constexpr double kBeyond_s = 1;

Timestamp Later(Timestamp time, double seconds) {
  return {time.nanoseconds + static_cast<int64_t>(1e9 * seconds)};
}

}  // namespace

RunningAlignment::RunningAlignment(const ImuWindow& imu, const InertialOptions& options)
    : imu_(imu), options_(options), wait_s_(options.running_wait_s) {
  options_.min_pose_interval_s =
      std::max(options.min_pose_interval_s, options.running_pose_interval_s);
}

double RunningAlignment::KeepSeconds(const InertialOptions& options, double most_behind_s) {
  return options.running_window_s + kBeyond_s + most_behind_s;
}

void RunningAlignment::Restart() {
  path_.clear();
  tried_at_.reset();
  told_.reset();
  refusal_.clear();
  wait_s_ = options_.running_wait_s;
}

std::optional<MetricWorld> RunningAlignment::Add(const TimedPose& pose) {
  if (!path_.empty() && SecondsBetween(path_.back().time, pose.time) < options_.min_pose_interval_s)
    return std::nullopt;
  path_.push_back(pose);
  const auto is_old = [&](const TimedPose& earlier) {
    return SecondsBetween(earlier.time, pose.time) > options_.running_window_s;
  };
  path_.erase(path_.begin(), std::find_if_not(path_.begin(), path_.end(), is_old));
  if (SecondsBetween(path_.front().time, pose.time) < options_.min_duration_s) return std::nullopt;
  if (tried_at_ && SecondsBetween(*tried_at_, pose.time) < wait_s_) return std::nullopt;
  tried_at_ = pose.time;
  const ImuStream along =
      imu_.Between(Later(path_.front().time, -kBeyond_s), Later(path_.back().time, kBeyond_s));
  const InertialAttempt attempt = AlignInertially(path_, along, options_);
  refusal_ = attempt.reason;
  if (!attempt.found) return std::nullopt;
  wait_s_ = std::min(2 * wait_s_, options_.running_window_s);
  const MetricWorld found{LevelWorld(attempt.found->level_from_world), attempt.found->scale_sigma,
                          attempt.found->tilt_sigma_rad};
  if (!IsNews(found)) return std::nullopt;
  told_ = found;
  return told_;
}

bool RunningAlignment::IsNews(const MetricWorld& found) const {
  if (!told_) return true;
  if (kSurer * found.scale_sigma <= told_->scale_sigma) return true;
  const Sim3 between = found.metric_from_world * told_->metric_from_world.Inverse();
  const double scale_sigma = std::hypot(found.scale_sigma, told_->scale_sigma);
  const double tilt_sigma_rad = std::hypot(found.tilt_sigma_rad, told_->tilt_sigma_rad);
  const double tilt_rad = Eigen::AngleAxisd(between.rotation()).angle();
  return std::abs(std::log(between.scale())) > kContradiction * scale_sigma ||
         tilt_rad > kContradiction * tilt_sigma_rad;
}

}  // namespace deepuav
