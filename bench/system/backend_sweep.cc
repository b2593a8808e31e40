// Runs everything behind the features with several option sets over the same features, extracted
// once and kept in a file, and prints one line each: what an option does to accuracy, without the
// networks' time.
//
//   backend_sweep DATASET FEATURES_FILE MODEL.onnx VOCABULARY ["name=value name=value ..." ...]
//
// VOCABULARY may be empty (""): no place is recognised then. Beside the program's options, stride=N
// runs every N-th frame, repeat=N shows all of it N times, start=N and end=N a part, drop_from=A
// drop_to=B leaves frames out (a jump of the camera), blind_from=A blind_to=B takes all features
// away, and keypoints=N keeps the best. The file holds faint key points too, so that
// features.threshold and features.faint_keypoints can be varied, but no other options of features.
// With superglue.model=FILE that network matches, as with the program's matching.method=superglue.
// section=N prints the scale of every N metres of the path.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>
#include <sstream>

#include "bench_main.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/evaluation/measures/evaluation.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/matching/superglue.h"
#include "deepuav/system/slam.h"
#include "stored_sequence.h"

namespace deepuav {
namespace {

Trajectory TrajectoryOf(const SlamResult& result, MapId map) {
  Trajectory trajectory;
  for (const FrameRecord& record : result.frames) {
    if (record.map == map) trajectory.push_back({record.time, record.cam_from_world.Inverse()});
  }
  return trajectory;
}

/// Estimated over true distance between ends of sections of the path, the whole path's being 1.
std::vector<double> ScalesAlong(const Evaluation& evaluation, double section_m) {
  std::vector<double> scales;
  const Trajectory& truth = evaluation.matched_truth;
  const Trajectory& estimate = evaluation.matched_estimate;
  double travelled_m = 0;
  size_t from = 0;
  for (size_t i = 1; i < truth.size(); ++i) {
    const auto distance = [](const Trajectory& path, size_t a, size_t b) {
      return (path[b].world_from_cam.translation() - path[a].world_from_cam.translation()).norm();
    };
    travelled_m += distance(truth, i - 1, i);
    if (travelled_m < section_m) continue;
    if (distance(truth, from, i) > 0)
      scales.push_back(distance(estimate, from, i) / distance(truth, from, i));
    from = i;
    travelled_m = 0;
  }
  return scales;
}

/// How far the frames that were placed between others lie from the truth, and in standard
/// deviations.
void PrintInferred(const Evaluation& evaluation, const SlamResult& result) {
  std::map<Timestamp, const FrameRecord*> inferred;
  for (const FrameRecord& record : result.frames) {
    if (record.located() && record.inferred) inferred.emplace(record.time, &record);
  }
  const double scale = evaluation.ate.truth_from_estimate.scale();
  double squares = 0, farthest_m = 0, ratios = 0;
  int count = 0;
  for (size_t i = 0; i < evaluation.matched_truth.size(); ++i) {
    const auto found = inferred.find(evaluation.matched_estimate[i].time);
    if (found == inferred.end()) continue;
    const double error_m = (evaluation.matched_truth[i].world_from_cam.translation() -
                            evaluation.matched_estimate[i].world_from_cam.translation())
                               .norm();
    const Matrix6d covariance = found->second->pose_information.inverse();
    squares += error_m * error_m;
    ratios += error_m * error_m / (scale * scale * covariance.topLeftCorner<3, 3>().trace());
    farthest_m = std::max(farthest_m, error_m);
    ++count;
  }
  if (count == 0) return;
  fmt::print("   {} inferred: {:.4f} m, farthest {:.4f} m, {:.2f} standard deviations\n", count,
             std::sqrt(squares / count), farthest_m, std::sqrt(ratios / count));
}

void RunVariant(Dataset* dataset_to_run, const std::vector<Features>& features, const Truth& truth,
                const std::optional<Vocabulary>& vocabulary, const std::string& variant) {
  const Dataset& dataset = *dataset_to_run;
  SystemOptions options;
  NearestNeighbourOptions matching;
  OptionRegistry registry;
  RegisterOptions(&options, &registry);
  registry.Add("matching", &matching);
  SuperPointOptions superpoint;
  registry.Add("features", &superpoint);
  SuperGlueOptions superglue;
  registry.Add("superglue", &superglue);
  std::istringstream words(variant);
  Part part{.end = dataset.size()};
  double section_m = 0;
  for (std::string word; words >> word;) {
    if (word.starts_with("section=")) {
      section_m = std::stod(word.substr(word.find('=') + 1));
    } else if (!SetPart(word, &part)) {
      registry.SetAssignment(word);
    }
  }

  StoredExtractor extractor(&features, superpoint, part);
  NearestNeighbourMatcher matcher(matching);
  Perception perception{&extractor, &matcher, vocabulary ? &*vocabulary : nullptr};
  std::optional<SuperGlueMatcher> learned;
  if (!superglue.model.empty()) {
    learned.emplace(dataset.camera().width, dataset.camera().height, superglue,
                    superglue.Inference({}));
    perception.matcher = &*learned;
    perception.quick_matcher = &matcher;
    perception.matcher_is_learned = true;
  }
  Slam slam(dataset.camera(), options, perception);
  PartImages images(dataset_to_run, part);
  const Stopwatch running;
  const SlamResult result = slam.Run(&images, Schedule::kSequential);
  fmt::print("{}\n", variant.empty() ? "(defaults)" : variant);
  for (MapId id : slam.atlas().Remaining()) {
    const Map& map = slam.atlas().At(id);
    const Trajectory trajectory = TrajectoryOf(result, map.id());
    EvaluationOptions evaluation;
    evaluation.horizontal = !truth.has_orientation;
    double ate = std::nan(""), farthest_m = std::nan("");
    std::vector<double> scales;
    if (trajectory.size() > 5) {
      const Evaluation evaluated = EvaluateTrajectory(truth, trajectory, evaluation);
      ate = evaluated.ate.statistics_m.rmse;
      farthest_m = evaluated.ate.statistics_m.max;
      PrintInferred(evaluated, result);
      if (section_m > 0) scales = ScalesAlong(evaluated, section_m);
    }
    fmt::print(
        "   map {}: {} frames, {} keyframes, {} landmarks, ATE {:.4f} m, farthest {:.3f} m\n",
        map.id().value, trajectory.size(), map.KeyframeCount(), map.LandmarkCount(), ate,
        farthest_m);
    if (section_m > 0) fmt::print("   scales along the path: {:.3f}\n", fmt::join(scales, " "));
  }
  int shown = 0;
  for (const FrameRecord& record : result.frames) {
    if (!record.located() && shown++ < 5)
      fmt::print("   frame {} has no pose: {}\n", record.id.value, record.reason);
  }
  fmt::print("   {} relocalisations, {} loops, {} maps merged; {:.1f} s\n", result.relocalisations,
             result.closed_loops, result.merged_maps, running.Seconds());
  std::fflush(stdout);
}

}  // namespace
}  // namespace deepuav

int main(int argc, char** argv) {
  if (argc < 5) {
    std::cerr << "usage: backend_sweep DATASET FEATURES_FILE MODEL.onnx VOCABULARY "
                 "[\"name=value ...\" ...]\n";
    return 2;
  }
  return deepuav::RunBench("backend_sweep", [&] {
    const auto dataset = deepuav::OpenDataset(argv[1]);
    const auto features = deepuav::LoadOrExtract(dataset.get(), argv[2], argv[3]);
    const deepuav::Truth truth = deepuav::LoadTruth(argv[1], false);
    std::optional<deepuav::Vocabulary> vocabulary;
    if (*argv[4] != 0) vocabulary = deepuav::Vocabulary::Load(argv[4]);
    std::vector<std::string> variants(argv + 5, argv + argc);
    if (variants.empty()) variants.push_back("");
    for (const std::string& variant : variants)
      deepuav::RunVariant(dataset.get(), features, truth, vocabulary, variant);
    return 0;
  });
}
