#include "deepuav/sensors/georeference_hypothesis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "deepuav/base/median.h"
#include "deepuav/base/random.h"
#include "deepuav/geometry/alignment.h"

namespace deepuav {
namespace {

constexpr uint64_t kSeed = 27;
constexpr int kHypotheses = 300;
constexpr size_t kMostJudged = 400;  // PathPositions that judge a hypothesis.

/// The similarity through three positions; where they lie on one line, with the ground roughly
/// below the camera.
std::optional<Sim3> AlignThree(std::vector<Eigen::Vector3d> source,
                               std::vector<Eigen::Vector3d> target,
                               const Eigen::Vector3d& down_world) {
  if (auto aligned = Align(source, target, AlignmentKind::kSimilar)) return aligned;
  const auto add_below = [](const Eigen::Vector3d& down, std::vector<Eigen::Vector3d>* points) {
    const Eigen::Vector3d line = points->back() - points->front();
    const Eigen::Vector3d across = down - line * (line.dot(down) / line.squaredNorm());
    points->push_back(points->front() + line.norm() * across.normalized());
  };
  add_below(down_world, &source);
  add_below(-Eigen::Vector3d::UnitZ(), &target);
  if (!source.back().allFinite() || !target.back().allFinite()) return std::nullopt;
  return Align(source, target, AlignmentKind::kSimilar);
}

using Three = std::array<size_t, 3>;

/// Three neighbours tell little.
Three OneOfEachThird(int count, Random* random) {
  Three three;
  for (int k = 0; k < 3; ++k) {
    const int first = k * count / 3, size = (k + 1) * count / 3 - first;
    three[static_cast<size_t>(k)] = static_cast<size_t>(first + random->Index(size));
  }
  return three;
}

/// Of any, not next to one another where there are many: all of a third may be wrong, as spoofed.
Three Apart(int count, Random* random) {
  constexpr int kParts = 12;
  const int least = count / kParts;
  const int free = count - 2 * least;
  std::array<int, 3> at;
  for (int& index : at) index = random->Index(free - 2);
  std::ranges::sort(at);
  Three three;
  for (size_t k = 0; k < 3; ++k)
    three[k] = static_cast<size_t>(at[k]) + k * (static_cast<size_t>(least) + 1);
  return three;
}

}  // namespace

Eigen::Vector3d AntennaResidual(const PathEstimate& estimate, const PositionOnPath& at,
                                const Eigen::Vector3d& antenna_cam_m) {
  const SE3& camera = at.camera.world_from_cam;
  const Sim3& local = estimate.local_from_world;
  const Eigen::Vector3d centre =
      local * (camera.translation() + estimate.clock_shift_s * at.velocity_world);
  return centre + local.rotation() * (camera.rotation() * antenna_cam_m) - at.position_m;
}

std::vector<double> AntennaDistances(const PathEstimate& estimate, const PathPositions& positions,
                                     const Eigen::Vector3d& antenna_cam_m) {
  std::vector<double> distances;
  distances.reserve(positions.size());
  for (const PositionOnPath& at : positions) {
    distances.push_back(
        AntennaResidual(estimate, at, antenna_cam_m).cwiseQuotient(at.sigma_m).norm());
  }
  return distances;
}

Eigen::Vector3d DownByCameras(const PathPositions& positions) {
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  for (const PositionOnPath& at : positions)
    down += at.camera.world_from_cam.rotation() * Eigen::Vector3d(0, 1, 1);
  return down.normalized();
}

PathHypothesis BestHypothesis(const PathPositions& all, const Eigen::Vector3d& antenna_cam_m,
                              const Eigen::Vector3d& down_world) {
  PathPositions positions;
  const size_t stride = 1 + all.size() / kMostJudged;
  for (size_t i = 0; i < all.size(); i += stride) positions.push_back(all[i]);
  Random random(kSeed);
  PathHypothesis best;
  const auto count = static_cast<int>(positions.size());
  if (count < 3) return best;
  for (int i = 0; i < kHypotheses; ++i) {
    std::vector<Eigen::Vector3d> source, target;
    for (const size_t index : i % 2 == 0 ? OneOfEachThird(count, &random) : Apart(count, &random)) {
      source.push_back(positions[index].camera.world_from_cam.translation());
      target.push_back(positions[index].position_m);
    }
    const auto aligned = AlignThree(source, target, down_world);
    if (!aligned || !(aligned->scale() > 0)) continue;
    const PathEstimate estimate{*aligned, 0};
    const double median = Median(AntennaDistances(estimate, positions, antenna_cam_m));
    if (median < best.median) best = {estimate, median};
  }
  return best;
}

Sim3 Upright(const Sim3& local_from_world, const PathPositions& positions,
             const Eigen::Vector3d& down_world) {
  const auto place = [&](const PositionOnPath& at) {
    return local_from_world * at.camera.world_from_cam.translation();
  };
  const Eigen::Vector3d first = place(positions.front());
  Eigen::Vector3d farthest = first;
  for (const PositionOnPath& at : positions) {
    if ((place(at) - first).norm() > (farthest - first).norm()) farthest = place(at);
  }
  const Eigen::Vector3d line = (farthest - first).stableNormalized();
  const Eigen::Vector3d down = line.cross(local_from_world.rotation() * down_world);
  const Eigen::Vector3d wanted = line.cross(-Eigen::Vector3d::UnitZ());
  const Eigen::Quaterniond roll =
      RotationExp(std::atan2(line.dot(down.cross(wanted)), down.dot(wanted)) * line);
  return Sim3(1, roll, first - roll * first) * local_from_world;
}

}  // namespace deepuav
