#include "deepuav/estimation/paths/smooth_motion.h"

#include <cmath>
#include <optional>

namespace deepuav {
namespace {

/// Whitens an error [of the value; of its rate] of white noise on acceleration: W^T W = Q^-1, with
/// Q = density [[t^3 / 3, t^2 / 2], [t^2 / 2, t]].
Eigen::Matrix2d WhiteningOver(double between_s, double density) {
  const double scale = 1 / std::sqrt(density * between_s);
  Eigen::Matrix2d whitening;
  whitening << std::sqrt(12.0) / between_s, -std::sqrt(3.0), 0, 1;
  return scale * whitening;
}

/// Of one kind of motion: errors of value and rate, and their derivatives by the parameters.
template <typename Rows>
void Whiten(const Eigen::Matrix2d& whitening, int value, Rows* rows) {
  const auto of_value = rows->template middleRows<3>(value).eval();
  const auto of_rate = rows->template middleRows<3>(value + 3).eval();
  rows->template middleRows<3>(value) = whitening(0, 0) * of_value + whitening(0, 1) * of_rate;
  rows->template middleRows<3>(value + 3) = whitening(1, 1) * of_rate;
}

struct Pace {
  Eigen::Vector3d velocity, turn;
  double over_s;
};

std::optional<Pace> PaceBetween(const TimedPose& a, const TimedPose& b, double max_step_s) {
  const double over_s = SecondsBetween(a.time, b.time);
  if (!(over_s > 0 && over_s <= max_step_s)) return std::nullopt;
  const SE3 &from = a.world_from_cam, &to = b.world_from_cam;
  return Pace{(to.translation() - from.translation()) / over_s,
              RotationLog(from.rotation().conjugate() * to.rotation()) / over_s, over_s};
}

}  // namespace

bool MotionNoise::usable() const {
  return travel > 0 && turn > 0 && std::isfinite(travel) && std::isfinite(turn);
}

MovingCamera Moved(const MovingCamera& camera, const MovingCameraStep& step) {
  MovingCamera moved = camera;
  moved.centre_world += step.segment<3>(kCentreAt);
  moved.world_from_cam =
      (camera.world_from_cam * RotationExp(step.segment<3>(kOrientationAt))).normalized();
  moved.velocity_world_per_s += step.segment<3>(kVelocityAt);
  moved.turn_cam_rad_per_s += step.segment<3>(kTurnAt);
  return moved;
}

MovingCameraStep SmoothMotionError(const MovingCamera& first, const MovingCamera& second,
                                   double between_s, const MotionNoise& noise,
                                   MovingCameraMatrix* by_first, MovingCameraMatrix* by_second) {
  // Rows: centre, velocity, orientation, turning.
  constexpr int kTravelRow = 0, kTurnRow = 6;
  const Eigen::Vector3d turn =
      RotationLog(first.world_from_cam.conjugate() * second.world_from_cam);
  MovingCameraStep error;
  error << second.centre_world - first.centre_world - between_s * first.velocity_world_per_s,
      second.velocity_world_per_s - first.velocity_world_per_s,
      turn - between_s * first.turn_cam_rad_per_s,
      second.turn_cam_rad_per_s - first.turn_cam_rad_per_s;
  const Eigen::Matrix2d travel = WhiteningOver(between_s, noise.travel);
  const Eigen::Matrix2d turning = WhiteningOver(between_s, noise.turn);
  const auto whiten = [&](auto* rows) {
    Whiten(travel, kTravelRow, rows);
    Whiten(turning, kTurnRow, rows);
  };
  whiten(&error);
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  if (by_first) {
    by_first->setZero();
    by_first->block<3, 3>(kTravelRow, kCentreAt) = -identity;
    by_first->block<3, 3>(kTravelRow, kVelocityAt) = -between_s * identity;
    by_first->block<3, 3>(kTravelRow + 3, kVelocityAt) = -identity;
    by_first->block<3, 3>(kTurnRow, kOrientationAt) = -RotationLeftJacobian(turn).inverse();
    by_first->block<3, 3>(kTurnRow, kTurnAt) = -between_s * identity;
    by_first->block<3, 3>(kTurnRow + 3, kTurnAt) = -identity;
    whiten(by_first);
  }
  if (by_second) {
    by_second->setZero();
    by_second->block<3, 3>(kTravelRow, kCentreAt) = identity;
    by_second->block<3, 3>(kTravelRow + 3, kVelocityAt) = identity;
    by_second->block<3, 3>(kTurnRow, kOrientationAt) = RotationLeftJacobian(-turn).inverse();
    by_second->block<3, 3>(kTurnRow + 3, kTurnAt) = identity;
    whiten(by_second);
  }
  return error;
}

MotionNoise MeasureMotionNoise(std::span<const TimedPose> path, double max_step_s,
                               int min_changes) {
  MotionNoise noise;
  int changes = 0;
  std::optional<Pace> before;
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    const std::optional<Pace> after = PaceBetween(path[i], path[i + 1], max_step_s);
    if (before && after) {
      // The mean paces of two steps differ by a variance of density * (their durations) / 3 an
      // axis.
      const double over_s = before->over_s + after->over_s;
      noise.travel += (after->velocity - before->velocity).squaredNorm() / over_s;
      noise.turn += (after->turn - before->turn).squaredNorm() / over_s;
      ++changes;
    }
    before = after;
  }
  if (changes < min_changes) return {};
  noise.travel /= changes;
  noise.turn /= changes;
  return noise;
}

}  // namespace deepuav
