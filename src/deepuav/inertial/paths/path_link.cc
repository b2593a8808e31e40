#include "deepuav/inertial/paths/path_link.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr size_t kMinPoses = 5;
/// Of the camera's speed over a window after being blind, by what the samples err.
constexpr double kSpeedSigma_m_s = 0.1;

LinkAttempt Refused(std::string reason) { return {std::nullopt, std::move(reason)}; }

LinkAttempt NoSamples() { return Refused("samples are missing meanwhile"); }

double SecondsApart(Timestamp a, Timestamp b) { return std::abs(SecondsBetween(a, b)); }

/// A camera's pose as the path has it and as the samples lead there.
struct PosePair {
  Timestamp time;
  SE3 world_from_cam, path_from_cam;
};

/// Those of the poses nearest to the known motion in time, the nearest first.
std::vector<PosePair> PairsAfter(const MotionState& known, const Trajectory& path,
                                 const SE3& cam_from_imu, const DeadReckoning& reckoning,
                                 double window_s) {
  Trajectory nearest = path;
  std::stable_sort(nearest.begin(), nearest.end(), [&](const TimedPose& a, const TimedPose& b) {
    return SecondsApart(a.time, known.time) < SecondsApart(b.time, known.time);
  });
  std::vector<PosePair> pairs;
  for (const TimedPose& pose : nearest) {
    if (SecondsApart(pose.time, nearest.front().time) > window_s) break;
    const std::optional<MotionState> there = reckoning.At(pose.time, known);
    if (!there) break;
    pairs.push_back(
        {pose.time, there->world_from_imu * cam_from_imu.Inverse(), pose.world_from_cam});
  }
  return pairs;
}

/// The mean turn from the path's world, nothing where single ones are too far from it.
std::optional<Eigen::Quaterniond> MeanTurn(const std::vector<PosePair>& pairs,
                                           double max_turn_rad) {
  const auto turn_of = [](const PosePair& pair) {
    return pair.world_from_cam.rotation() * pair.path_from_cam.rotation().conjugate();
  };
  const Eigen::Quaterniond first = turn_of(pairs.front());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double square = 0;
  for (const PosePair& pair : pairs) {
    const Eigen::Vector3d beside = RotationLog(first.conjugate() * turn_of(pair));
    mean += beside / static_cast<double>(pairs.size());
    square += beside.squaredNorm() / static_cast<double>(pairs.size());
  }
  if (!(std::sqrt(square) <= max_turn_rad)) return std::nullopt;
  return first * RotationExp(mean);
}

/// Both paths about their first pose, the path's turned into the world.
struct Displacements {
  double along = 0, square = 0, misfit_square = 0;  ///< Of the world's; of both by `scale`.
  double scale() const { return along / square; }
};

Displacements CompareDisplacements(const std::vector<PosePair>& pairs,
                                   const Eigen::Quaterniond& turn) {
  Displacements sums;
  const auto both = [&](const PosePair& pair) {
    const PosePair& first = pairs.front();
    return std::pair<Eigen::Vector3d, Eigen::Vector3d>(
        pair.world_from_cam.translation() - first.world_from_cam.translation(),
        turn * (pair.path_from_cam.translation() - first.path_from_cam.translation()));
  };
  for (const PosePair& pair : pairs) {
    const auto [world, path] = both(pair);
    sums.along += world.dot(path);
    sums.square += path.squaredNorm();
  }
  for (const PosePair& pair : pairs) {
    const auto [world, path] = both(pair);
    sums.misfit_square = std::max(sums.misfit_square, (world - sums.scale() * path).squaredNorm());
  }
  return sums;
}

}  // namespace

LinkAttempt LinkMotions(const MotionState& known, const MotionState& there,
                        const DeadReckoning& reckoning, const InertialOptions& options) {
  const std::optional<MotionState> reckoned = reckoning.At(there.time, known);
  if (!reckoned) return NoSamples();
  const Eigen::Quaterniond turn =
      reckoned->world_from_imu.rotation() * there.world_from_imu.rotation().conjugate();
  const Eigen::Matrix3d axes = turn.toRotationMatrix();
  if (const double tilt_deg = std::acos(std::clamp(axes(2, 2), -1.0, 1.0)) / kDegree;
      !(tilt_deg <= options.max_blind_turn_deg)) {
    return Refused(fmt::format("what is level differs by {:.1f} degrees", tilt_deg));
  }
  const Eigen::Quaterniond heading(Eigen::AngleAxisd(
      std::atan2(axes(1, 0) - axes(0, 1), axes(0, 0) + axes(1, 1)), Eigen::Vector3d::UnitZ()));
  if (const double speed = (reckoned->velocity_m_s - heading * there.velocity_m_s).norm();
      !(speed <= options.max_blind_misfit_m_s)) {
    return Refused(fmt::format("the velocity differs by {:.2f} m/s", speed));
  }
  const Eigen::Vector3d place =
      reckoned->world_from_imu.translation() - heading * there.world_from_imu.translation();
  return {Sim3(1, heading, place), ""};
}

LinkAttempt LinkPath(const MotionState& known, const Trajectory& path, const SE3& cam_from_imu,
                     const DeadReckoning& reckoning, const InertialOptions& options) {
  const std::vector<PosePair> pairs =
      PairsAfter(known, path, cam_from_imu, reckoning, options.blind_window_s);
  if (pairs.size() < kMinPoses)
    return Refused(fmt::format("{} poses have samples: expected {}", pairs.size(), kMinPoses));
  const auto turn = MeanTurn(pairs, kDegree * options.max_blind_turn_deg);
  if (!turn) return Refused("the gyroscope misses the camera's turns");
  const Displacements moved = CompareDisplacements(pairs, *turn);
  const PosePair &first = pairs.front(), &last = pairs.back();
  const double seconds = SecondsApart(first.time, last.time);
  const double flown_m =
      (last.world_from_cam.translation() - first.world_from_cam.translation()).norm();
  const double scale_sigma = kSpeedSigma_m_s * seconds / flown_m;
  if (!(moved.square > 0 && moved.scale() > 0 && scale_sigma <= options.max_blind_scale_sigma))
    return Refused("the camera moves too little to tell the scale");
  if (const double speed = std::sqrt(moved.misfit_square) / seconds;
      !(speed <= options.max_blind_misfit_m_s)) {
    return Refused(fmt::format("the samples miss the path by {:.2f} m/s", speed));
  }
  const Eigen::Vector3d place = first.world_from_cam.translation() -
                                moved.scale() * (*turn * first.path_from_cam.translation());
  return {Sim3(moved.scale(), *turn, place), ""};
}

}  // namespace deepuav
