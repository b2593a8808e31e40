#include "deepuav/inertial/camera_turns.h"

#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

/// Of a readout that samples must cover: beyond them the turn is taken to bend on as it did.
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
  const auto& samples = integrator_.samples();
  const Timestamp first = std::max(Timestamp{time.nanoseconds - half_ns}, samples.front().time);
  const Timestamp last = std::min(Timestamp{time.nanoseconds + half_ns}, samples.back().time);
  const double covered = SecondsBetween(first, last) / camera_.readout_s;
  if (!(covered >= kLeastShare)) return std::nullopt;
  const Timestamp between{first.nanoseconds + (last.nanoseconds - first.nanoseconds) / 2};
  const auto before = TurnBetween(first, between), after = TurnBetween(between, last);
  if (!before || !after) return std::nullopt;
  // TurnAt from a moment to another is their difference times (turn + their sum times bend).
  const double middle = SecondsBetween(time, between) / camera_.readout_s;
  ReadoutMotion turn;
  turn.bend_rad = 2 / (covered * covered) * (*after - *before);
  turn.turn_rad = (*before + *after) / covered - 2 * middle * turn.bend_rad;
  return turn;
}

std::optional<Eigen::Quaterniond> CameraTurns::Between(Timestamp before, Timestamp now) const {
  const std::optional<Preintegration> motion = integrator_.Between(before, now, {});
  if (!motion) return std::nullopt;
  return cam_from_imu_ * motion->rotation.conjugate() * cam_from_imu_.conjugate();
}

}  // namespace deepuav
