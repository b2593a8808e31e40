// Whether a map's error is noise or something that its observations have in common:
//
//   map_at_truth MAP.deepuav TRUTH [facing]
//
// Measures all landmarks once more by their middle view (`facing`: as if all surfaces faced the
// camera), adjusts, and prints what the observations cost there and with the keyframes where they
// truly are, and the error of adjusted maps whose observations are the true ones with the noise
// that is stated. If all is noise, the truth costs about six more a keyframe than the adjusted map,
// whose error is one of these. Maps are best made with `--set mapping.moving.set_aside=false`.

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <string_view>

#include "bench_main.h"
#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "deepuav/evaluation/measures/truth.h"
#include "deepuav/geometry/alignment.h"
#include "deepuav/io/maps/map_file.h"
#include "deepuav/map/all_keyframes.h"
#include "deepuav/mapping/adjustment/bundle_window.h"
#include "deepuav/mapping/landmarks/patch_observation.h"

namespace deepuav {
namespace {

constexpr int64_t kMaxTimeDifferenceNs = 5'000'000;
constexpr int kNoisyMaps = 5;
constexpr BundleOptions kPrecise = {.max_iterations = 100, .min_relative_decrease = 1e-9};

std::vector<Eigen::Vector3d> Centres(const std::vector<SE3>& cam_from_world) {
  std::vector<Eigen::Vector3d> centres;
  for (const SE3& pose : cam_from_world) centres.push_back(pose.InverseTranslation());
  return centres;
}

Sim3 AlignedTo(const std::vector<SE3>& truth, const BundleProblem& problem) {
  const auto aligned =
      Align(Centres(problem.cam_from_world), Centres(truth), AlignmentKind::kSimilar);
  if (!aligned) throw Error("the keyframes lie on a line: expected a path that can be aligned");
  return *aligned;
}

void Print(std::string_view name, const BundleProblem& problem, const BundleReport& report,
           const std::vector<SE3>& truth) {
  const Sim3 truth_from_map = AlignedTo(truth, problem);
  double squared = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    squared += (truth_from_map * problem.cam_from_world[i].InverseTranslation() -
                truth[i].InverseTranslation())
                   .squaredNorm();
  }
  std::cout << fmt::format("{:<28} {:>10.1f} {:>9} {:>9} {:>10.4f}\n", name, report.final_cost,
                           problem.observations.size(),
                           std::count(report.outlier.begin(), report.outlier.end(), 1),
                           std::sqrt(squared / static_cast<double>(truth.size())));
}

std::vector<SE3> TruePoses(const Map& map, const std::vector<KeyframeId>& keyframes,
                           const Trajectory& trajectory) {
  std::map<int64_t, SE3> by_time;
  for (const TimedPose& pose : trajectory)
    by_time.emplace(pose.time.nanoseconds, pose.world_from_cam);
  std::vector<SE3> poses;
  for (const KeyframeId id : keyframes) {
    const int64_t time = map.At(id).frame.time.nanoseconds;
    const auto found = by_time.lower_bound(time - kMaxTimeDifferenceNs);
    if (found == by_time.end() || found->first > time + kMaxTimeDifferenceNs)
      throw Error("no true pose at {} ns: expected one of every keyframe", time);
    poses.push_back(found->second.Inverse());
  }
  return poses;
}

/// The inliers' pixels as the problem's state has them, with the noise that is stated of each.
BundleProblem WithStatedNoise(BundleProblem problem, const BundleReport& report, Random* random) {
  std::vector<BundleObservation> noisy;
  for (size_t i = 0; i < problem.observations.size(); ++i) {
    if (report.outlier[i]) continue;
    BundleObservation o = problem.observations[i];
    const Eigen::Matrix2d root = o.noise.Covariance().llt().matrixL();
    o.px = problem.pinhole.Project(problem.cam_from_world[static_cast<size_t>(o.camera)] *
                                   problem.landmarks_world[static_cast<size_t>(o.landmark)]) +
           root * Eigen::Vector2d(random->Gaussian(1), random->Gaussian(1));
    noisy.push_back(o);
  }
  problem.observations = std::move(noisy);
  return problem;
}

void ForgetNormals(Map* map) {
  std::vector<LandmarkId> landmarks;
  map->landmarks().ForEach([&](const Landmark& landmark) { landmarks.push_back(landmark.id); });
  for (const LandmarkId id : landmarks) map->SetNormal(id, Eigen::Vector3d::Zero());
}

int Run(int argc, char** argv) {
  const bool facing = argc == 4 && std::string_view(argv[3]) == "facing";
  if (argc != 3 && !facing) {
    std::cerr << "usage: map_at_truth MAP.deepuav TRUTH [facing]\n";
    return 2;
  }
  LoadedAtlas loaded = ReadMapFile(argv[1]);
  Map& map = loaded.atlas.At(loaded.atlas.Remaining().at(0));
  if (facing) ForgetNormals(&map);
  PatchObserver(loaded.camera, {}, {}, {.enabled = !facing}).RemeasureAll(&map);
  BundleWindow window = MakeBundleWindow(map, AllKeyframes(map), loaded.camera.pinhole);
  const std::vector<SE3> truth = TruePoses(map, window.keyframes, LoadTruth(argv[2]).trajectory);

  std::cout << fmt::format("{:<28} {:>10} {:>9} {:>9} {:>10}\n", "", "cost", "seen", "outliers",
                           "ATE");
  const std::vector<uint8_t> fixed = window.problem.camera_fixed;
  BundleReport report = AdjustBundle(&window.problem, kPrecise);
  Print("adjusted", window.problem, report, truth);

  BundleProblem& at_truth = window.problem;
  const Sim3 truth_from_map = AlignedTo(truth, at_truth);
  for (Eigen::Vector3d& landmark : at_truth.landmarks_world) landmark = truth_from_map * landmark;
  at_truth.cam_from_world = truth;
  at_truth.camera_fixed.assign(truth.size(), 1);
  report = AdjustBundle(&at_truth, kPrecise);
  Print("at the truth", at_truth, report, truth);

  at_truth.camera_fixed = fixed;
  Random random(1);
  for (int i = 0; i < kNoisyMaps; ++i) {
    BundleProblem noisy = WithStatedNoise(at_truth, report, &random);
    const BundleReport adjusted = AdjustBundle(&noisy, kPrecise);
    Print("of stated noise, adjusted", noisy, adjusted, truth);
  }
  return 0;
}

}  // namespace
}  // namespace deepuav

int main(int argc, char** argv) {
  return deepuav::RunBench("map_at_truth", [&] { return deepuav::Run(argc, argv); });
}
