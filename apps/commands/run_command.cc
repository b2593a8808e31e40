#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>

#include "arguments/argument_checks.h"
#include "arguments/option_arguments.h"
#include "commands/commands.h"
#include "deepuav/assembly/datasets/dataset_run.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/files/folder_lock.h"
#include "work/interruption.h"
#include "work/progress_bar.h"
#if DEEPUAV_WITH_REPORT
#include "arguments/view_arguments.h"
#endif

namespace deepuav {
namespace {

/// What the command line says.
struct RunArguments {
  DatasetRequest request;
  std::string out, log_level = "info";
  bool localise_only = false;
  OptionArguments options;
#if DEEPUAV_WITH_REPORT
  ViewArguments view;
#endif
};

/// A run ends with an error where nothing came of it, and after all was written.
void CheckOutcome(const RunArguments& arguments, const FinishedRun& run) {
  const SlamResult& result = run.result;
  if (!result.failure.empty())
    throw Error("{} (what was computed is in {})", result.failure, arguments.out);
  ExitIfInterrupted();
  const std::string& dataset = arguments.request.dataset;
  if (result.frames.empty()) throw Error("{}: no image could be read", dataset);
  if (run.atlas.Remaining().empty())
    throw Error("{}: no map was started: {}", dataset, result.frames.back().reason);
}

void Run(const RunArguments& arguments) {
  LogToStderr(arguments.log_level);
  OptionArguments options = arguments.options;
  if (arguments.localise_only) options.assignments.push_back("system.localise_only=true");
  auto settings = ReadRunSettings(options);
  DatasetRun dataset_run(arguments.request, std::move(settings));
  MakeOutputFolder(arguments.out);
  const FolderLock lock(arguments.out);
  ProbeOutput(std::filesystem::path(arguments.out) / "summary.json");
  CatchSignals();
  RunObserver* observer = nullptr;
#if DEEPUAV_WITH_REPORT
  const auto view = StartView(arguments.view, arguments.request.dataset);
  if (view) observer = view->Observe(dataset_run.camera());
#endif
  std::optional<ProgressBar> bar(dataset_run.images());
  const FinishedRun run =
      dataset_run.Run({.progress =
                           [&bar](FrameId frame, const std::string& state) {
                             bar->Advance(static_cast<int>(frame.value) + 1, state);
                           },
                       .work = [&bar](const std::string& what, int done,
                                      int total) { bar->Count(what, done, total); },
                       .stop = [] { return SignalReceived() != 0; },
                       .observer = observer});
  bar.reset();
  if (run.result.frames.empty()) ExitIfInterrupted();  // An earlier run's files are worth more.
  WriteRunOutput(arguments.out, run);
  std::cout << DescribeRun(run.atlas, run.result, run.facts);
  CheckOutcome(arguments, run);
}

void AddArguments(CLI::App& command, RunArguments& arguments) {
  constexpr int kMaxFrame = std::numeric_limits<int>::max();
  command.add_option("DATASET", arguments.request.dataset, "Folder or video file")
      ->required()
      ->check(NamedPath());
  command.add_option("--out", arguments.out, "Folder for the results, made if absent")
      ->required()
      ->check(NamedOutput());
  AddOptionArguments(command, arguments.options);
  AddFeaturesArguments(command, arguments.options);
  AddPrecisionArgument(command, arguments.options);
  command.add_option("--camera", arguments.request.camera,
                     "Calibration (camera.yaml) that overrides the dataset's");
  command.add_option("--map", arguments.request.map,
                     "Go on with the maps of an earlier run (its map.deepuav)");
  command
      .add_flag("--localise-only", arguments.localise_only,
                "Find the frames in these maps and leave them as they are")
      ->needs("--map");
  command
      .add_option(
          "--use", arguments.request.use,
          "Sensors: auto (all that are there), or some of camera,imu,gnss,barometer,attitude")
      ->capture_default_str();
  command.add_option("--start", arguments.request.range.start, "First frame, from 0")
      ->check(CLI::Range(0, kMaxFrame).description(""))
      ->capture_default_str();
  command.add_option("--end", arguments.request.range.end, "One past the last frame; -1: all")
      ->check(CLI::Range(-1, kMaxFrame).description(""))
      ->capture_default_str();
  command.add_option("--stride", arguments.request.range.stride, "Every n-th frame")
      ->check(CLI::Range(1, kMaxFrame).description(""))
      ->capture_default_str();
  command
      .add_option("--schedule", arguments.request.schedule,
                  "Order of the work; live keeps the pace of the images")
      ->check(CLI::IsMember({"sequential", "threaded", "live"}))
      ->capture_default_str();
#if DEEPUAV_WITH_REPORT
  AddViewArguments(command, arguments.view);
#endif
  AddLogLevelArgument(command, arguments.log_level);
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
