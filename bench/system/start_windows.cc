// Starts maps at random moments of sequences and flights: how many start, how soon, and how many
// wrongly.
//
//   start_windows DATASET... --features FOLDER --model MODEL.onnx [--windows N] [--variant
//   "name=value ..."]...
//
// Each window is run from nothing with each variant of the options, over features that are
// extracted once. There is parallax in it where the camera goes a fifth of the depth of what it
// sees (as one run over the whole sequence tells that depth). A map is wrong where it is off by
// more than a tenth: its path from the truth's, over the truth's extent, or the scale of its first
// half from its second's. Delays are those of the first frame that is located when its turn comes:
// after the window's first frame, and after the frame by which the camera has gone a twentieth of
// the depth.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <map>
#include <sstream>

#include "bench_main.h"
#include "deepuav/base/median.h"
#include "deepuav/base/random.h"
#include "deepuav/evaluation/measures/association.h"
#include "deepuav/evaluation/measures/truth.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/system/slam.h"
#include "stored_sequence.h"
#include "window_verdict.h"

namespace deepuav {
namespace {

constexpr double kSlowestHz = 2;

struct Arguments {
  std::vector<std::string> datasets, variants;
  std::string features, model;
  int windows = 200, frames = 60, seed = 1;
  bool verbose = false;
};

struct Sequence {
  std::string name;
  std::unique_ptr<Dataset> dataset;
  std::vector<Features> features;
  TruthOfFrames truth;
};

struct Window {
  size_t sequence = 0;
  Part part;
};

SlamResult RunPart(const Sequence& sequence, const Part& part, const std::string& variant,
                   std::map<MapId, std::map<LandmarkId, Eigen::Vector3d>>* landmarks) {
  SystemOptions options;
  NearestNeighbourOptions matching;
  SuperPointOptions superpoint;
  OptionRegistry registry;
  RegisterOptions(&options, &registry);
  registry.Add("matching", &matching);
  registry.Add("features", &superpoint);
  std::istringstream words(variant);
  for (std::string word; words >> word;) registry.SetAssignment(word);
  StoredExtractor extractor(&sequence.features, superpoint, part);
  NearestNeighbourMatcher matcher(matching);
  Slam slam(sequence.dataset->camera(), options, {&extractor, &matcher});
  PartImages images(sequence.dataset.get(), part);
  SlamResult result = slam.Run(&images, Schedule::kSequential);
  if (landmarks) {
    for (MapId map : slam.atlas().Remaining()) {
      slam.atlas().At(map).landmarks().ForEach([&](const Landmark& landmark) {
        (*landmarks)[map][landmark.id] = landmark.position_world;
      });
    }
  }
  return result;
}

std::vector<std::optional<Eigen::Vector3d>> TrueCentres(const Dataset& dataset,
                                                        const Truth& truth) {
  std::vector<std::optional<Eigen::Vector3d>> centres(static_cast<size_t>(dataset.size()));
  Trajectory frames;
  for (int i = 0; i < dataset.size(); ++i) frames.push_back({dataset.Time(i), SE3()});
  for (const AssociatedPair& pair : Associate(truth.trajectory, frames)) {
    centres[static_cast<size_t>(pair.estimate)] =
        truth.trajectory[static_cast<size_t>(pair.truth)].world_from_cam.translation();
  }
  return centres;
}

/// Median distance of what each frame sees, in metres, from a run over all of them; of a frame that
/// was not located that of the nearest one before it, or after.
std::vector<double> Depths(const Sequence& sequence) {
  std::map<MapId, std::map<LandmarkId, Eigen::Vector3d>> landmarks;
  const SlamResult result =
      RunPart(sequence, Part{.end = sequence.dataset->size()}, "", &landmarks);
  const std::optional<MapId> map = LargestMap(result);
  if (!map) {
    fmt::print("{}: no map over all of it, so its windows are not judged\n", sequence.name);
    return std::vector<double>(result.frames.size(), std::numeric_limits<double>::infinity());
  }
  std::vector<Eigen::Vector3d> estimate, truth;
  std::vector<double> depths(result.frames.size(), 0);
  for (size_t i = 0; i < result.frames.size(); ++i) {
    const FrameRecord& record = result.frames[i];
    if (record.map != *map || !sequence.truth.centre[i]) continue;
    const Eigen::Vector3d centre = record.cam_from_world.InverseTranslation();
    estimate.push_back(centre);
    truth.push_back(*sequence.truth.centre[i]);
    std::vector<double> distances;
    for (const FrameRecord::Seen& seen : record.seen) {
      const auto place = landmarks[*map].find(seen.landmark);
      if (place != landmarks[*map].end()) distances.push_back((place->second - centre).norm());
    }
    if (distances.empty()) continue;
    depths[i] = Median(std::move(distances));
  }
  const double scale = ScaleBetween(estimate, truth);
  double last = 0;
  for (double& depth : depths) last = depth = depth > 0 ? depth * scale : last;
  for (size_t i = depths.size(); i-- > 0;) last = depths[i] = depths[i] > 0 ? depths[i] : last;
  return depths;
}

Sequence LoadSequence(const std::string& folder, const Arguments& arguments) {
  Sequence sequence;
  sequence.name = std::filesystem::path(folder).filename().string();
  sequence.dataset = OpenDataset(folder);
  sequence.features =
      LoadOrExtract(sequence.dataset.get(), arguments.features + "/" + sequence.name + ".features",
                    arguments.model);
  sequence.truth.centre = TrueCentres(*sequence.dataset, LoadTruth(folder, false));
  sequence.truth.depth_m = Depths(sequence);
  return sequence;
}

std::vector<Window> DrawWindows(const std::vector<Sequence>& sequences,
                                const Arguments& arguments) {
  Random random(static_cast<uint64_t>(arguments.seed));
  std::vector<Window> windows;
  for (int i = 0; i < arguments.windows; ++i) {
    const size_t s = static_cast<size_t>(i) % sequences.size();
    const Dataset& dataset = *sequences[s].dataset;
    const double period_s = SecondsBetween(dataset.Time(0), dataset.Time(1));
    const int most_stride = std::clamp(
        std::min(static_cast<int>(1 / (kSlowestHz * period_s)), dataset.size() / arguments.frames),
        1, 4);
    Part part{.stride = 1 + random.Index(most_stride)};
    const int length = std::min(arguments.frames * part.stride, dataset.size());
    part.start = random.Index(dataset.size() - length + 1);
    part.end = part.start + length;
    windows.push_back({s, part});
  }
  return windows;
}

double MedianOrNone(const std::vector<double>& values) {
  return values.empty() ? std::nan("") : Median(values);
}

/// What became of some windows, in one line of the table.
void PrintRow(const std::string& name, const std::vector<Verdict>& verdicts) {
  int with_parallax = 0, right = 0, started = 0, wrong = 0;
  std::vector<double> delays, after_parallax, shape;
  double located = 0;
  for (const Verdict& v : verdicts) {
    started += v.started;
    wrong += v.wrong;
    located += v.located;
    with_parallax += v.has_parallax;
    if (v.judged) shape.push_back(v.shape_error);
    if (!v.has_parallax || !v.started) continue;
    right += !v.wrong;
    delays.push_back(v.delay_s);
    after_parallax.push_back(v.delay_after_parallax_s);
  }
  const auto percent = [](double part, double all) { return all > 0 ? 100 * part / all : 0; };
  fmt::print("| {} | {} | {} | {:.1f} | {} | {:.1f} | {:.2f} | {:.2f} | {:.3f} | {:.1f} |\n", name,
             verdicts.size(), with_parallax, percent(right, with_parallax), wrong,
             percent(wrong, static_cast<double>(verdicts.size())), MedianOrNone(delays),
             MedianOrNone(after_parallax), MedianOrNone(shape),
             located / static_cast<double>(verdicts.size()));
}

void RunVariant(const std::vector<Sequence>& sequences, const std::vector<Window>& windows,
                const std::string& variant, bool verbose) {
  std::vector<Verdict> all;
  std::map<std::string, std::vector<Verdict>> by_sequence;
  for (const Window& window : windows) {
    const Sequence& sequence = sequences[window.sequence];
    const SlamResult result = RunPart(sequence, window.part, variant, nullptr);
    const Verdict v = JudgeWindow(*sequence.dataset, sequence.truth, window.part, result);
    all.push_back(v);
    by_sequence[sequence.name].push_back(v);
    if (verbose || v.wrong || (v.has_parallax && !v.started)) {
      fmt::print(
          "{} start={} end={} stride={}: {}, first online {}, {} located, scale change "
          "{:.3f}, shape {:.3f}{}\n",
          sequence.name, window.part.start, window.part.end, window.part.stride,
          v.wrong     ? "WRONG"
          : v.started ? "started"
                      : "no map",
          v.first_online, v.located, v.scale_change, v.shape_error,
          v.has_parallax ? "" : ", no parallax");
    }
  }
  fmt::print(
      "\n{}\n\n| sequence | windows | with parallax | of these right, % | wrong | of all, % | "
      "delay, s | after parallax, s | shape error | located of a window |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n",
      variant.empty() ? "(defaults)" : variant);
  for (const auto& [name, verdicts] : by_sequence) PrintRow(name, verdicts);
  PrintRow("all", all);
  std::fflush(stdout);
}

void Run(const Arguments& arguments) {
  std::filesystem::create_directories(arguments.features);
  std::vector<Sequence> sequences;
  for (const std::string& folder : arguments.datasets)
    sequences.push_back(LoadSequence(folder, arguments));
  const std::vector<Window> windows = DrawWindows(sequences, arguments);
  for (const std::string& variant : arguments.variants)
    RunVariant(sequences, windows, variant, arguments.verbose);
}

}  // namespace
}  // namespace deepuav

int main(int argc, char** argv) {
  deepuav::Arguments arguments;
  CLI::App app("Starts maps at random moments of sequences");
  app.add_option("datasets", arguments.datasets, "folders of datasets with truth")->required();
  app.add_option("--features", arguments.features, "folder where features are kept")->required();
  app.add_option("--model", arguments.model, "SuperPoint network")->required();
  app.add_option("--windows", arguments.windows, "how many, over all datasets in turn");
  app.add_option("--frames", arguments.frames, "frames of a window");
  app.add_option("--seed", arguments.seed, "of the windows");
  app.add_option("--variant", arguments.variants, "options of the program, name=value ...");
  app.add_flag("--verbose", arguments.verbose, "print every window");
  CLI11_PARSE(app, argc, argv);
  if (arguments.variants.empty()) arguments.variants.push_back("");
  return deepuav::RunBench("start_windows", [&] {
    deepuav::Run(arguments);
    return 0;
  });
}
