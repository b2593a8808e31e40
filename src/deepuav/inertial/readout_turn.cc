#include "deepuav/sensors/readout_turn.h"

#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

/// Samples further apart say nothing of what was between them.
constexpr double kMaxGapS = 0.05;

/// So long the first and the last sample speak for before and after.
constexpr double kMaxBeyondEndS = 0.01;

}  // namespace

ReadoutTurns::ReadoutTurns(const ImuStream& imu, const Camera& camera) : camera_(camera) {
  for (const ImuSample& sample : imu.samples) {
    if (!sample.angular_velocity.allFinite()) continue;
    if (!times_.empty() && sample.time <= times_.back()) continue;
    const Eigen::Vector3d rate = imu.cam_from_imu.rotation() * sample.angular_velocity;
    const Eigen::Vector3d step =
        times_.empty()
            ? Eigen::Vector3d::Zero().eval()
            : (SecondsBetween(times_.back(), sample.time) / 2 * (rates_cam_.back() + rate)).eval();
    angles_cam_.push_back(angles_cam_.empty() ? step : (angles_cam_.back() + step).eval());
    times_.push_back(sample.time);
    rates_cam_.push_back(rate);
  }
}

std::optional<Eigen::Vector3d> ReadoutTurns::At(Timestamp time) const {
  const auto half_ns = static_cast<int64_t>(std::llround(camera_.readout_s / 2 * 1e9));
  const auto first = AngleSinceStart({time.nanoseconds - half_ns});
  const auto last = AngleSinceStart({time.nanoseconds + half_ns});
  if (!first || !last) return std::nullopt;
  // So short a turn is one about a fixed axis: its parts add up.
  return (*last - *first).eval();
}

std::optional<Eigen::Vector3d> ReadoutTurns::AngleSinceStart(Timestamp time) const {
  if (times_.empty()) return std::nullopt;
  const auto after = std::lower_bound(times_.begin(), times_.end(), time);
  const size_t next = static_cast<size_t>(after - times_.begin());
  const size_t before = next == 0 ? 0 : next - 1, behind = std::min(next, times_.size() - 1);
  const double gap_s = SecondsBetween(times_[before], times_[behind]);
  const double since_s = SecondsBetween(times_[before], time);
  if (gap_s > kMaxGapS || std::abs(since_s) > std::max(gap_s, kMaxBeyondEndS)) return std::nullopt;
  const Eigen::Vector3d change = rates_cam_[behind] - rates_cam_[before];
  const Eigen::Vector3d rate = rates_cam_[before] + (gap_s > 0 ? since_s / gap_s : 0) * change;
  return (angles_cam_[before] + since_s / 2 * (rates_cam_[before] + rate)).eval();
}

}  // namespace deepuav
