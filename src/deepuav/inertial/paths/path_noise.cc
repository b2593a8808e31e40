#include "deepuav/inertial/paths/path_noise.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "deepuav/base/median.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
/// Of the squared norm of three normal errors.
constexpr double kMedianChiSquare = 2.366;
/// About a pose, to either side.
constexpr double kWindow_s = 2;
/// A quiet stretch is no better than this share of the whole path.
constexpr double kLeastShare = 0.3;
constexpr double kMinTurnSigma_rad = 0.002 * kDegree;
/// No path is better than this share of its extent, as one without any error could not be weighed.
constexpr double kMinPositionShare = 1e-6;
/// Over the median distance of poses from between their neighbours.
constexpr double kJump = 20;
/// That tell what is usual about a pose, to either side, at least and at most.
constexpr size_t kSomePoses = 8, kManyPoses = 30;
/// Residuals count up to so many standard deviations, correlations down to this one.
constexpr double kLongest = 3, kLeastCorrelation = 0.05;

double ExtentOf(const Trajectory& path) {
  Eigen::AlignedBox3d box;
  for (const TimedPose& pose : path) box.extend(pose.world_from_cam.translation());
  return box.diagonal().norm();
}

double SigmaOf(const std::vector<Vector6d>& residuals, int first, size_t from, size_t to) {
  std::vector<double> squares;
  for (size_t k = from; k < to; ++k)
    squares.push_back(residuals[k].segment<3>(first).squaredNorm());
  return std::sqrt(Median(std::move(squares)) / kMedianChiSquare);
}

/// The median of those before or that of those after one, whichever is more: a flight from the
/// ground begins with no jump, however quiet it was there.
double UsualAbout(const std::vector<double>& distances, size_t i) {
  const auto median = [&](size_t from, size_t to) {
    const auto at = [&](size_t k) { return distances.begin() + static_cast<std::ptrdiff_t>(k); };
    return to - from < kSomePoses ? 0 : Median(std::vector(at(from), at(to)));
  };
  const double before = median(i - std::min(i, kManyPoses), i);
  const double after = median(i + 1, std::min(distances.size(), i + 1 + kManyPoses));
  return std::max(before, after);
}

}  // namespace

Trajectory WithoutJumps(const Trajectory& path) {
  if (path.size() < 3) return path;
  std::vector<double> distances;
  for (size_t k = 1; k + 1 < path.size(); ++k) {
    const TimedPose between = InterpolatePose(path[k - 1], path[k + 1], path[k].time);
    distances.push_back(
        (path[k].world_from_cam.translation() - between.world_from_cam.translation()).norm());
  }
  const double least = std::max(Median(distances), kMinPositionShare * ExtentOf(path) / kJump);
  Trajectory kept;
  for (size_t k = 0; k < path.size(); ++k) {
    const size_t i = std::clamp<size_t>(k, 1, distances.size()) - 1;
    if (distances[i] <= kJump * std::max(UsualAbout(distances, i), least)) kept.push_back(path[k]);
  }
  return kept;
}

void EstimatePathNoise(const std::vector<Vector6d>& residuals, InertialProblem* problem) {
  constexpr int kTurn = 0, kShift = 3;
  const size_t count = residuals.size();
  const double turn = std::max(SigmaOf(residuals, kTurn, 0, count), kMinTurnSigma_rad);
  const double least = std::max(kLeastShare * SigmaOf(residuals, kShift, 0, count),
                                kMinPositionShare * ExtentOf(problem->path));
  problem->turn_sigma_rad.assign(count, turn);
  problem->position_sigma.resize(count);
  size_t from = 0, to = 0;
  for (size_t k = 0; k < count; ++k) {
    const Timestamp time = problem->path[k].time;
    while (SecondsBetween(problem->path[from].time, time) > kWindow_s) ++from;
    while (to < count && SecondsBetween(time, problem->path[to].time) <= kWindow_s) ++to;
    problem->position_sigma[k] = std::max(SigmaOf(residuals, kShift, from, to), least);
  }
}

double VarianceInflation(const std::vector<Vector6d>& residuals, const InertialProblem& problem) {
  const size_t count = residuals.size();
  std::vector<Eigen::Vector3d> whitened;
  double variance = 0;
  for (size_t k = 0; k < count; ++k) {
    const Eigen::Vector3d value = residuals[k].tail<3>() / problem.position_sigma[k];
    whitened.push_back(value * std::min(1.0, kLongest / std::max(value.norm(), 1e-9)));
    variance += whitened.back().squaredNorm();
  }
  double inflation = 1;
  for (size_t lag = 1; lag < count / 4; ++lag) {
    double sum = 0;
    for (size_t k = lag; k < count; ++k) sum += whitened[k].dot(whitened[k - lag]);
    if (!(sum > kLeastCorrelation * variance)) break;
    inflation += 2 * sum / variance;
  }
  return inflation;
}

}  // namespace deepuav
