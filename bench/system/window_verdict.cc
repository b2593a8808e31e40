#include "window_verdict.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

#include "deepuav/geometry/alignment.h"

namespace deepuav {
namespace {

constexpr double kParallaxTravel = 0.2, kFirstParallaxTravel = 0.05;  // over the depth
constexpr double kWrong = 0.1;
constexpr double kLeastHalfTravel = 0.05;  // over the depth: less tells no scale
constexpr int kLeastFrames = 10;           // located, to judge a map

void JudgeParallax(const Dataset& dataset, const TruthOfFrames& truth, const Part& part,
                   double first_online_s, Verdict* verdict) {
  const auto at = [&](int i) { return static_cast<size_t>(part.Frame(i)); };
  const auto& centre = truth.centre;
  double from_s = -1;
  for (int i = 0; i < part.size(); ++i) {
    if (!centre[at(0)] || !centre[at(i)]) continue;
    const double travel = (*centre[at(i)] - *centre[at(0)]).norm() / truth.depth_m[at(0)];
    if (travel >= kParallaxTravel) verdict->has_parallax = true;
    if (travel >= kFirstParallaxTravel && from_s < 0)
      from_s = SecondsBetween(dataset.Time(part.Frame(0)), dataset.Time(part.Frame(i)));
  }
  verdict->delay_s = first_online_s;
  verdict->delay_after_parallax_s = first_online_s - std::max(from_s, 0.0);
}

void JudgeShape(const TruthOfFrames& truth_of_frames, const Part& part, const SlamResult& result,
                Verdict* verdict) {
  std::vector<Eigen::Vector3d> estimate, truth;
  const std::optional<MapId> map = LargestMap(result);
  for (size_t i = 0; i < result.frames.size() && map; ++i) {
    const auto& centre =
        truth_of_frames.centre[static_cast<size_t>(part.Frame(static_cast<int>(i)))];
    if (result.frames[i].map != *map || !centre) continue;
    estimate.push_back(result.frames[i].cam_from_world.InverseTranslation());
    truth.push_back(*centre);
  }
  verdict->located = static_cast<int>(estimate.size());
  if (verdict->located < kLeastFrames) return;
  const double depth = truth_of_frames.depth_m[static_cast<size_t>(part.start)];
  const auto middle = static_cast<ptrdiff_t>(estimate.size() / 2);
  const auto halves = [middle](const std::vector<Eigen::Vector3d>& all) {
    return std::pair(std::vector(all.begin(), all.begin() + middle),
                     std::vector(all.begin() + middle, all.end()));
  };
  const auto [truth_before, truth_after] = halves(truth);
  const auto [before, after] = halves(estimate);
  const auto travels = [&](const std::vector<Eigen::Vector3d>& part_of_path) {
    return (part_of_path.back() - part_of_path.front()).norm() >= kLeastHalfTravel * depth;
  };
  if (travels(truth_before) && travels(truth_after)) {
    verdict->judged = true;
    verdict->scale_change = ScaleBetween(before, truth_before) / ScaleBetween(after, truth_after);
  }
  if (!travels(truth)) return;
  const auto aligned = Align(estimate, truth, AlignmentKind::kSimilar);
  if (!aligned) return;
  verdict->judged = true;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : truth) mean += p / static_cast<double>(truth.size());
  double error = 0, spread = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    error += (*aligned * estimate[i] - truth[i]).squaredNorm();
    spread += (truth[i] - mean).squaredNorm();
  }
  verdict->shape_error = std::sqrt(error / spread);
}

}  // namespace

std::optional<MapId> LargestMap(const SlamResult& result) {
  std::map<MapId, int> frames;
  for (const FrameRecord& record : result.frames) {
    if (record.located()) ++frames[record.map];
  }
  std::optional<MapId> largest;
  for (const auto& [map, count] : frames) {
    if (!largest || count > frames[*largest]) largest = map;
  }
  return largest;
}

double ScaleBetween(const std::vector<Eigen::Vector3d>& from,
                    const std::vector<Eigen::Vector3d>& to) {
  const auto spread = [](const std::vector<Eigen::Vector3d>& points) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const auto& p : points) mean += p / static_cast<double>(points.size());
    double squared = 0;
    for (const auto& p : points) squared += (p - mean).squaredNorm();
    return std::sqrt(squared / static_cast<double>(points.size()));
  };
  return spread(to) / spread(from);
}

Verdict JudgeWindow(const Dataset& dataset, const TruthOfFrames& truth, const Part& part,
                    const SlamResult& result) {
  Verdict verdict;
  double first_online_s = 0;
  for (const FrameRecord& record : result.frames) {
    if (!record.tracked_online) continue;
    verdict.started = true;
    verdict.first_online = static_cast<int>(&record - result.frames.data());
    first_online_s = SecondsBetween(result.frames.front().time, record.time);
    break;
  }
  JudgeParallax(dataset, truth, part, first_online_s, &verdict);
  JudgeShape(truth, part, result, &verdict);
  const bool scale_is_off =
      verdict.scale_change > 0 && std::abs(std::log(verdict.scale_change)) > std::log1p(kWrong);
  verdict.wrong = verdict.judged && (scale_is_off || verdict.shape_error > kWrong);
  return verdict;
}

}  // namespace deepuav
