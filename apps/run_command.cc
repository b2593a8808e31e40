#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>

#include "argument_checks.h"
#include "camera_checks.h"
#include "commands.h"
#include "dataset_images.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/folder_lock.h"
#include "deepuav/io/map_file.h"
#include "deepuav/io/map_origin.h"
#include "deepuav/io/options_file.h"
#include "deepuav/system/photo_survey.h"
#include "found_calibration.h"
#include "interruption.h"
#include "progress_bar.h"
#include "run_options.h"
#include "run_output.h"
#include "sample_calibration.h"
#include "sensor_use.h"

namespace deepuav {
namespace {

/// What the command line says.
struct RunArguments {
  std::string dataset, out, camera, map, schedule = "threaded", use = "auto", log_level = "info";
  bool localise_only = false;
  OptionArguments options;
  FrameRange range;
};

/// Throws Error where the images were not taken with the maps' camera.
LoadedAtlas LoadMaps(const std::string& file, const Dataset& dataset, RunOptions* options) {
  LoadedAtlas loaded = ReadMapFile(file);
  const Camera& here = dataset.camera();
  const Camera& there = loaded.camera;
  if (here.width != there.width || here.height != there.height) {
    throw Error("{}: its camera has {} x {} px: expected {} x {} as the images", file, there.width,
                there.height, here.width, here.height);
  }
  loaded.camera.readout_s = here.readout_s;
  if (dataset.CalibrationIsApproximate()) options->system.refine_focal = false;
  CheckSameCamera(file, there, here, "the dataset's", dataset.CalibrationIsApproximate());
  return loaded;
}

/// Of the maps' descriptors; nothing where there are none.
std::optional<int> DimensionOf(const Atlas& atlas) {
  std::optional<int> dimension;
  for (const MapId map : atlas.Remaining()) {
    atlas.At(map).keyframes().ForEach(
        [&](const Keyframe& keyframe) { dimension = keyframe.features().descriptors.dimension(); });
  }
  return dimension;
}

/// Throws Error where descriptors cannot be compared, warns where they may differ.
void CheckNetwork(const std::string& file, const LoadedAtlas& loaded, const Eyes& eyes) {
  const MapOrigin& origin = loaded.origin;
  const int wanted = eyes.extractor().dimension(),
            held = DimensionOf(loaded.atlas).value_or(wanted);
  if (held != wanted) {
    throw Error("{}: holds descriptors of dimension {}: expected {} as {} gives", file, held,
                wanted, eyes.extractor().Description());
  }
  if (origin.features == eyes.extractor().Description()) return;
  Log().warn("{}: made with {}, continued with {}: places may not be recognised", file,
             origin.features, eyes.extractor().Description());
}

/// Of maps that grow: all that made them. Maps that only localise stay as they are.
MapOrigin OriginOf(const std::optional<LoadedAtlas>& loaded, const Eyes& eyes, bool localise_only) {
  if (loaded && localise_only) return loaded->origin;
  const std::string now = eyes.extractor().Description();
  MapOrigin origin{DEEPUAV_VERSION, now, eyes.matcher().Description(), {}};
  if (!loaded) return origin;
  const std::string& before = loaded->origin.features;
  if (before != now)
    origin.features = before.find(now) == std::string::npos ? before + "; " + now : before;
  origin.image_names = loaded->origin.image_names;
  return origin;
}

/// For reports that are made from another working folder; of no path, none.
std::string AbsolutePath(const std::string& path) {
  return path.empty() ? "" : std::filesystem::absolute(path).lexically_normal().string();
}

/// What a run leaves behind, however it was done.
struct RunOutcome {
  SlamResult result;
  Atlas atlas;
  Camera camera;
  std::optional<RefinedLens> lens;
};

/// Photographs are mapped all at once, unless they are to be found in maps that are there or there
/// are too many.
bool IsSurvey(const RunArguments& arguments, const SurveyOptions& options, const Dataset& dataset,
              int images) {
  return dataset.Kind() == "photographs" && options.enabled && arguments.map.empty() &&
         arguments.schedule != "live" && images <= options.max_photographs;
}

void Run(const RunArguments& arguments) {
  const Stopwatch since_start;
  LogToStderr(arguments.log_level);
  RunOptions options;
  OptionRegistry registry;
  ReadOptions(arguments.options, &options, &registry);
  options.system.localise_only |= arguments.localise_only;
  if (options.system.localise_only && arguments.map.empty())
    throw CLI::ValidationError("option system.localise_only: expected --map with it");
  if (options.system.localise_only && !RecognisesPlaces(options))
    throw CLI::ValidationError(
        "option system.localise_only: expected places.vocabulary and looping.enabled with it, by "
        "which the map is found");
  const Schedule schedule = ParseSchedule(arguments.schedule);
  CheckSensorList(arguments.use);

  options.images.camera_file = arguments.camera;
  const auto dataset = OpenDataset(arguments.dataset, options.images);
  DatasetImages images(dataset.get(), arguments.range);
  SensorUse sensors = ReadSensorsUsed(arguments.use, *dataset);
  MakeOutputFolder(arguments.out);
  const FolderLock lock(arguments.out);
  ProbeOutput(std::filesystem::path(arguments.out) / "summary.json");
  if (dataset->CalibrationIsApproximate()) options.system.refine_focal = true;
  std::optional<LoadedAtlas> loaded;
  if (!arguments.map.empty()) loaded = LoadMaps(arguments.map, *dataset, &options);
  const bool is_survey = IsSurvey(arguments, options.system.survey, *dataset, images.count());
  const auto stop = [] { return SignalReceived() != 0; };
  CatchSignals();
  std::optional<SampleCalibration> sample;
  if (!loaded && !is_survey) sample = CalibrateFromSample(dataset.get(), options, stop);
  if (sample) options.system.refine_focal = false;
  const Camera camera = loaded ? loaded->camera : sample ? sample->camera : dataset->camera();
  Eyes eyes(camera, options);
  const MapOrigin origin = OriginOf(loaded, eyes, options.system.localise_only);
  KeyframeId first_new_keyframe{0};
  if (loaded) {
    CheckNetwork(arguments.map, *loaded, eyes);
    first_new_keyframe.value = loaded->atlas.ids().keyframes;
  }

  RunFacts facts{AbsolutePath(arguments.dataset),
                 dataset->Kind(),
                 AbsolutePath(arguments.camera),
                 arguments.schedule,
                 eyes.extractor().Description(),
                 eyes.matcher().Description(),
                 eyes.VocabularyDescription(),
                 eyes.models(),
                 images.count(),
                 0,
                 0,
                 0,
                 OptionTexts(registry),
                 OptionsAsYaml(registry),
                 origin,
                 first_new_keyframe,
                 {},
                 {},
                 {}};
  facts.use = arguments.use;
  facts.sensors = std::move(sensors.facts);
  std::optional<ProgressBar> bar(images.count());
  const auto advance = [&](FrameId frame, const std::string& state) {
    if (facts.start_up_s == 0) facts.start_up_s = since_start.Seconds();
    bar->Advance(static_cast<int>(frame.value) + 1, state);
  };
  const Stopwatch running;
  RunOutcome outcome;
  if (is_survey) {
    SurveyRun survey = RunSurvey(
        camera, dataset->Calibration().focal_sigma, options.system, eyes.perception(), &images,
        [&](FrameId frame) { advance(frame, "features"); }, stop, sensors.streams);
    outcome = {std::move(survey.result), std::move(survey.outcome.atlas),
               std::move(survey.outcome.camera), survey.outcome.lens};
  } else {
    Slam slam(camera, options.system, eyes.perception());
    if (loaded) slam.Load(std::move(loaded->atlas));
    slam.UseSensors(std::move(sensors.streams));
    outcome.result = slam.Run(
        &images, schedule,
        [&](const FrameRecord& record) {
          advance(record.id, record.located() ? "tracking" : record.reason);
        },
        stop);
    outcome.atlas = slam.TakeAtlas();
    outcome.camera = slam.camera();
    if (sample) outcome.lens = sample->lens;
  }
  bar.reset();
  facts.wall_s = running.Seconds();
  facts.unreadable = images.unreadable();
  if (!options.system.localise_only)
    NameImages(outcome.atlas, *dataset, &facts.map_origin.image_names);
  facts.calibration = DescribeCalibration(*dataset, outcome.camera, outcome.lens);
  WriteRunOutput(arguments.out, outcome.atlas, outcome.camera, outcome.result, facts);
  std::cout << DescribeRun(outcome.atlas, outcome.result, facts);
  if (!outcome.result.failure.empty())
    throw Error("{} (what was computed is in {})", outcome.result.failure, arguments.out);
  ExitIfInterrupted();
  if (outcome.result.frames.empty()) throw Error("{}: no image could be read", arguments.dataset);
  if (outcome.atlas.Remaining().empty()) {
    throw Error("{}: no map was started: {}", arguments.dataset,
                outcome.result.frames.back().reason);
  }
}

void AddArguments(CLI::App& command, RunArguments& arguments) {
  constexpr int kMaxFrame = std::numeric_limits<int>::max();
  command.add_option("DATASET", arguments.dataset, "Folder or video file")
      ->required()
      ->check(NamedPath());
  command.add_option("--out", arguments.out, "Folder for the results, made if absent")
      ->required()
      ->check(NamedOutput());
  AddOptionArguments(command, arguments.options);
  AddFeaturesArguments(command, arguments.options);
  AddPrecisionArgument(command, arguments.options);
  command.add_option("--camera", arguments.camera,
                     "Calibration (camera.yaml) that overrides the dataset's");
  command.add_option("--map", arguments.map,
                     "Go on with the maps of an earlier run (its map.deepuav)");
  command
      .add_flag("--localise-only", arguments.localise_only,
                "Find the frames in these maps and leave them as they are")
      ->needs("--map");
  command
      .add_option("--use", arguments.use,
                  "Sensors: auto (all that are there), or some of camera,imu,gnss,barometer")
      ->capture_default_str();
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
