#include "deepuav/inertial/camera_turns.h"

#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

/// Of a readout that samples must cover: where they end, they speak for the rest of it, too.
constexpr double kLeastShare = 0.4;

}  // namespace

CameraTurns::CameraTurns(const ImuStream& imu, double max_gap_s, const Camera& camera)
    : camera_(camera),
      cam_from_imu_(imu.cam_from_imu.rotation()),
      integrator_(CleanSamples(imu.samples), imu.noise, max_gap_s) {}

std::optional<Eigen::Vector3d> CameraTurns::TurnBetween(Timestamp from, Timestamp to) const {
  const std::optional<Preintegration> motion = integrator_.Between(from, to, {});
  if (!motion) return std::nullopt;
  return cam_from_imu_ * RotationLog(motion->rotation);
}

std::optional<ReadoutMotion> CameraTurns::DuringReadout(Timestamp time) const {
  if (camera_.readout_s == 0 || integrator_.samples().empty()) return std::nullopt;
  const auto half_ns = static_cast<int64_t>(std::llround(camera_.readout_s / 2 * 1e9));
  const Timestamp begin{time.nanoseconds - half_ns}, end{time.nanoseconds + half_ns};
  const Timestamp first = std::max(begin, integrator_.samples().front().time);
  const Timestamp last = std::min(end, integrator_.samples().back().time);
  const double covered = SecondsBetween(first, last) / camera_.readout_s;
  if (!(covered >= kLeastShare)) return std::nullopt;
  ReadoutMotion turn;
  if (first == begin && last == end) {
    const auto until_middle = TurnBetween(first, time), since_middle = TurnBetween(time, last);
    if (!until_middle || !since_middle) return std::nullopt;
    turn.turn_rad = *until_middle + *since_middle;
    turn.bend_rad = 2 * (*since_middle - *until_middle);
  } else {
    const auto part = TurnBetween(first, last);
    if (!part) return std::nullopt;
    turn.turn_rad = *part / covered;
  }
  return turn;
}

std::optional<Eigen::Quaterniond> CameraTurns::Between(Timestamp before, Timestamp now) const {
  const std::optional<Preintegration> motion = integrator_.Between(before, now, {});
  if (!motion) return std::nullopt;
  return cam_from_imu_ * motion->rotation.conjugate() * cam_from_imu_.conjugate();
}

}  // namespace deepuav
