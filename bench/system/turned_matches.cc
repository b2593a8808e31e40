// What turned descriptors are worth: matches between photographs of two parts of a survey flown
// under different headings.
//
//   turned_matches DATASET MODEL.onnx SPLIT [MAX_DISTANCE_M]
//
// Takes every pair of a photograph before and one from number SPLIT on whose fixes are nearer than
// MAX_DISTANCE_M, and counts the mutual nearest neighbours that agree with a homography, upright
// and with the first photograph turned.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <opencv2/calib3d.hpp>

#include "bench_main.h"
#include "deepuav/base/error.h"
#include "deepuav/base/median.h"
#include "deepuav/base/time.h"
#include "deepuav/evaluation/measures/truth.h"
#include "deepuav/features/superpoint.h"
#include "deepuav/features/superpoint_turned.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/matching/nearest_neighbour.h"

namespace deepuav {
namespace {

constexpr double kMaxErrorPx = 4;
constexpr int kIterations = 5000;
constexpr double kConfidence = 0.9999;

struct Photograph {
  Features features;
  TurnedDescriptors turned;
};

int HomographyInliers(const Features& a, const Features& b, const std::vector<Match>& matches) {
  if (matches.size() < 4) return 0;
  std::vector<cv::Point2f> from, to;
  for (const Match& match : matches) {
    const Eigen::Vector2f& p = a.keypoints[static_cast<size_t>(match.a)].px;
    const Eigen::Vector2f& q = b.keypoints[static_cast<size_t>(match.b)].px;
    from.emplace_back(p.x(), p.y());
    to.emplace_back(q.x(), q.y());
  }
  std::vector<uint8_t> inlier;
  cv::findHomography(from, to, cv::USAC_ACCURATE, kMaxErrorPx, inlier, kIterations, kConfidence);
  return static_cast<int>(std::count(inlier.begin(), inlier.end(), 1));
}

double FastestMs(const std::vector<double>& seconds) {
  return 1000 * *std::min_element(seconds.begin(), seconds.end());
}

double ResidentMb() {
  std::ifstream statm("/proc/self/statm");
  double pages_total = 0, pages_resident = 0;
  statm >> pages_total >> pages_resident;
  return pages_resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

std::vector<Photograph> Describe(Dataset* dataset, const std::string& model) {
  SuperPointOptions options;
  options.model = model;
  options = options.OfPhotographs();
  SuperPoint extractor(dataset->camera(), options, {});
  const double resident_before_mb = ResidentMb();
  const Stopwatch making;
  SuperPointTurned describer({dataset->camera().width, dataset->camera().height}, model, {});
  fmt::print("two networks made in {:.2f} s\n", making.Seconds());
  std::vector<Photograph> photographs;
  std::vector<double> extract_s, turn_s;
  for (int i = 0; i < dataset->size(); ++i) {
    const GreyImage image = dataset->Load(i);
    const Stopwatch extracting;
    Features features = extractor.Extract(image);
    extract_s.push_back(extracting.Seconds());
    const Stopwatch turning;
    TurnedDescriptors turned = describer.Describe(image, features);
    turn_s.push_back(turning.Seconds());
    photographs.push_back({std::move(features), std::move(turned)});
  }
  fmt::print("{:.0f} MB of them and of {} photographs' descriptors\n",
             ResidentMb() - resident_before_mb, photographs.size());
  fmt::print(
      "fastest and median of a photograph, ms: features {:.1f}, {:.1f}; three turns {:.1f}, "
      "{:.1f}\n",
      FastestMs(extract_s), 1000 * Median(extract_s), FastestMs(turn_s), 1000 * Median(turn_s));
  return photographs;
}

/// Inliers upright and turned by 90, 180, 270 degrees.
std::array<int, 4> CountInliers(const Photograph& a, const Photograph& b,
                                NearestNeighbourMatcher* matcher) {
  std::array<int, 4> inliers{};
  for (size_t turns = 0; turns < inliers.size(); ++turns) {
    Features view = a.features;
    if (turns > 0) view.descriptors = a.turned[turns - 1];
    inliers[turns] = HomographyInliers(view, b.features, matcher->MatchFeatures(view, b.features));
  }
  return inliers;
}

void Compare(Dataset* dataset, const std::string& model, int split, double max_distance_m) {
  const std::vector<GnssFix> fixes = dataset->ReadSensors().gnss.fixes;
  if (std::ssize(fixes) != dataset->size())
    throw Error("{} of {} photographs have a position: expected all", fixes.size(),
                dataset->size());
  const Trajectory trajectory = LocalTrajectory(fixes, false);
  const std::vector<Photograph> photographs = Describe(dataset, model);

  NearestNeighbourMatcher matcher({});
  constexpr std::array kLevels = {15, 20, 30, 50, 100};
  std::array<int, kLevels.size()> upright_above{}, turned_above{};
  std::array<int, 4> best_turn{};
  std::vector<int> upright, turned;
  for (int i = 0; i < split; ++i) {
    for (int j = split; j < dataset->size(); ++j) {
      const auto a = static_cast<size_t>(i), b = static_cast<size_t>(j);
      const Eigen::Vector3d between =
          trajectory[a].world_from_cam.translation() - trajectory[b].world_from_cam.translation();
      if (between.norm() > max_distance_m) continue;
      const auto inliers = CountInliers(photographs[a], photographs[b], &matcher);
      const auto best = std::max_element(inliers.begin(), inliers.end());
      ++best_turn[static_cast<size_t>(best - inliers.begin())];
      upright.push_back(inliers[0]);
      turned.push_back(*best);
      for (size_t k = 0; k < kLevels.size(); ++k) {
        upright_above[k] += inliers[0] >= kLevels[k];
        turned_above[k] += *best >= kLevels[k];
      }
    }
  }
  if (upright.empty()) throw Error("no pair is nearer than {} m", max_distance_m);
  std::sort(upright.begin(), upright.end());
  std::sort(turned.begin(), turned.end());
  fmt::print("{} pairs nearer than {} m; best at 0, 90, 180, 270 degrees: {}, {}, {}, {}\n\n",
             upright.size(), max_distance_m, best_turn[0], best_turn[1], best_turn[2],
             best_turn[3]);
  fmt::print("| pairs with at least | upright alone | best of four headings |\n|---|---|---|\n");
  for (size_t k = 0; k < kLevels.size(); ++k) {
    fmt::print("| {} inliers | {} | {} |\n", kLevels[k], upright_above[k], turned_above[k]);
  }
  fmt::print("| median inliers | {} | {} |\n", upright[upright.size() / 2],
             turned[turned.size() / 2]);
}

}  // namespace
}  // namespace deepuav

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) {
    std::cerr << "usage: turned_matches DATASET MODEL.onnx SPLIT [MAX_DISTANCE_M]\n";
    return 2;
  }
  return deepuav::RunBench("turned_matches", [&] {
    const auto dataset = deepuav::OpenDataset(argv[1]);
    deepuav::Compare(dataset.get(), argv[2], std::stoi(argv[3]),
                     argc == 5 ? std::stod(argv[4]) : 8);
    return 0;
  });
}
