#include <csignal>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>

#include "commands.h"
#include "dataset_images.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/features/superpoint.h"
#include "deepuav/io/atomic_file.h"
#include "deepuav/io/options_file.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/matching/superglue.h"
#include "progress_bar.h"
#include "run_output.h"

namespace deepuav {
namespace {

constexpr int kSignalStatusBase = 128;

volatile std::sig_atomic_t signal_received = 0;

void RememberSignal(int signal) {
  signal_received = signal;
  std::signal(signal, SIG_DFL);  // a second one ends the program at once
}

/// What the command line says.
struct RunArguments {
  std::string dataset, out, config, camera, schedule = "threaded", log_level = "info";
  std::vector<std::string> assignments;
  FrameRange range;
};

/// Which matcher finds the key points of one image in another without knowing their poses.
struct MatcherChoice {
  std::string method = "nearest";

  void Check() const {
    if (method != "nearest" && method != "superglue") {
      throw Error("option matching.method is '{}': expected nearest or superglue", method);
    }
  }
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("method", method, "",
          "nearest (neighbours in descriptor space) or superglue (a network)");
  }
};

/// All options of a run.
struct RunOptions {
  SuperPointOptions features;
  InferenceOptions inference;
  MatcherChoice matcher;
  NearestNeighbourOptions matching;
  SuperGlueOptions superglue;
  SystemOptions system;

  void Check() const {
    features.Check();
    inference.Check();
    matcher.Check();
    if (matcher.method == "superglue") {
      superglue.Check();
    } else {
      matching.Check();
    }
    system.Check();
  }

  void Register(OptionRegistry* registry) {
    registry->Add("features", &features);
    registry->Add("inference", &inference);
    registry->Add("matching", &matcher);
    registry->Add("matching", &matching);
    registry->Add("superglue", &superglue);
    RegisterOptions(&system, registry);
  }
};

std::string DefaultCacheFolder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME")) return std::string(cache) + "/deepuav";
  if (const char* home = std::getenv("HOME")) return std::string(home) + "/.cache/deepuav";
  return "";
}

/// Options that are unknown or impossible are wrong use.
void ReadOptions(const RunArguments& arguments, RunOptions* options, OptionRegistry* registry) try {
  options->Register(registry);
  registry->Set("features.model", DEEPUAV_MODELS "/superpoint_small.onnx");
  registry->Set("inference.cache_dir", DefaultCacheFolder());
  if (!arguments.config.empty()) LoadOptionsFile(arguments.config, registry);
  for (const std::string& assignment : arguments.assignments) registry->SetAssignment(assignment);
  options->Check();
} catch (const Error& error) {
  throw CLI::ValidationError(error.what());
}

std::map<std::string, std::string> OptionTexts(const OptionRegistry& registry) {
  std::map<std::string, std::string> texts;
  for (const auto& [name, entry] : registry.entries()) texts[name] = entry.get();
  return texts;
}

std::unique_ptr<Matcher> MakeMatcher(const RunOptions& options, const Camera& camera) {
  if (options.matcher.method == "superglue") {
    return std::make_unique<SuperGlueMatcher>(camera.width, camera.height, options.superglue,
                                              options.inference);
  }
  return std::make_unique<NearestNeighbourMatcher>(options.matching);
}

/// Throws Error when no file can be made in it.
void MakeOutputFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Error("{}: cannot make the output folder: {}", folder.string(), error.message());
  // Before the work, not after it, it shows that nothing can be written here.
  const AtomicFile probe(folder / "summary.json");
}

void Run(const RunArguments& arguments) {
  const Stopwatch since_start;
  LogToStderr(arguments.log_level);
  RunOptions options;
  OptionRegistry registry;
  ReadOptions(arguments, &options, &registry);
  const Schedule schedule = ParseSchedule(arguments.schedule);

  const auto dataset = OpenDataset(arguments.dataset, {arguments.camera});
  DatasetImages images(dataset.get(), arguments.range);
  MakeOutputFolder(arguments.out);
  SuperPoint extractor(dataset->camera(), options.features, options.inference);
  const std::unique_ptr<Matcher> matcher = MakeMatcher(options, dataset->camera());
  Slam slam(dataset->camera(), options.system, &extractor, matcher.get());

  std::signal(SIGINT, RememberSignal);
  std::signal(SIGTERM, RememberSignal);
  RunFacts facts{arguments.dataset,
                 dataset->Kind(),
                 arguments.schedule,
                 extractor.Description(),
                 matcher->Description(),
                 images.count(),
                 0,
                 0,
                 0,
                 OptionTexts(registry)};
  std::optional<ProgressBar> bar(images.count());
  const auto show_progress = [&](const FrameRecord& record) {
    if (facts.start_up_s == 0) facts.start_up_s = since_start.Seconds();
    bar->Advance(static_cast<int>(record.id.value) + 1,
                 record.located() ? "tracking" : record.reason);
  };
  const Stopwatch running;
  const SlamResult result =
      slam.Run(&images, schedule, show_progress, [] { return signal_received != 0; });
  bar.reset();
  facts.wall_s = running.Seconds();
  facts.unreadable = images.unreadable();
  WriteRunOutput(arguments.out, slam.atlas(), dataset->camera(), result, facts);
  std::cout << DescribeRun(slam.atlas(), result, facts);
  if (!result.failure.empty())
    throw Error("{} (what was computed is in {})", result.failure, arguments.out);
  if (signal_received != 0) throw ExitStatus{kSignalStatusBase + signal_received};
  if (result.frames.empty()) throw Error("{}: no image could be read", arguments.dataset);
  if (slam.atlas().maps().empty()) {
    throw Error("{}: no map was started: {}", arguments.dataset, result.frames.back().reason);
  }
}

void AddArguments(CLI::App& command, RunArguments& arguments) {
  constexpr int kMaxFrame = std::numeric_limits<int>::max();
  command.add_option("DATASET", arguments.dataset, "Folder or video file")->required();
  command.add_option("--out", arguments.out, "Folder for the results, made if absent")->required();
  command.add_option("--config", arguments.config, "YAML file of options");
  command.add_option("--set", arguments.assignments, "One option as name=value; may be repeated")
      ->allow_extra_args(false);
  command.add_option("--camera", arguments.camera,
                     "Calibration (camera.yaml) that overrides the dataset's");
  command.add_option("--start", arguments.range.start, "First frame, from 0")
      ->check(CLI::Range(0, kMaxFrame).description(""))
      ->capture_default_str();
  command.add_option("--end", arguments.range.end, "One past the last frame; -1: all")
      ->check(CLI::Range(-1, kMaxFrame).description(""))
      ->capture_default_str();
  command.add_option("--stride", arguments.range.stride, "Every n-th frame")
      ->check(CLI::Range(1, kMaxFrame).description(""))
      ->capture_default_str();
  command
      .add_option("--schedule", arguments.schedule,
                  "Order of the work; live keeps the pace of the images")
      ->check(CLI::IsMember({"sequential", "threaded", "live"}))
      ->capture_default_str();
  command.add_option("--log-level", arguments.log_level, "What is logged to stderr")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
}

}  // namespace

void AddRunCommand(CLI::App& app) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* command =
      app.add_subcommand("run", "SLAM over a dataset, a folder of photographs or a video");
  command->footer(
      "Example:\n  deepuav run MH_01_easy --out out/mh01\n"
      "Datasets: EuRoC/ASL, TUM RGB-D, KITTI odometry, photographs with EXIF, video with "
      "camera.yaml.");
  AddArguments(*command, *arguments);
  command->callback([arguments] { Run(*arguments); });
}

}  // namespace deepuav
