#include <filesystem>
#include <iostream>
#include <memory>

#include "arguments/argument_checks.h"
#include "arguments/option_arguments.h"
#include "commands/commands.h"
#include "deepuav/assembly/live/live_run.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/files/folder_lock.h"
#include "deepuav/system/watching/observer_list.h"
#include "work/interruption.h"
#if DEEPUAV_WITH_MAVLINK
#include "arguments/autopilot_arguments.h"
#endif
#if DEEPUAV_WITH_REPORT
#include "arguments/view_arguments.h"
#endif

namespace deepuav {
namespace {

constexpr double kMostSeconds = 86'400;

/// What the command line says.
struct LiveArguments {
  LiveRequest request;
  std::string out, log_level = "info";
  double save_every_s = 60;
  bool localise_only = false;
  OptionArguments options;
#if DEEPUAV_WITH_MAVLINK
  AutopilotArguments autopilot;
#endif
#if DEEPUAV_WITH_REPORT
  ViewArguments view;
#endif
};

#if DEEPUAV_WITH_REPORT
FeedView FeedOf(const LiveStatus& status) {
  constexpr double kMs = 1e3;
  const char* pictures[] = {"open", "open, stands still", "open, frozen"};
  FeedView view;
  if (!status.is_fed) return view;  // Before tracking begins.
  view.link = status.counts.is_open ? pictures[static_cast<int>(status.counts.picture)] : "closed";
  view.arrived = status.counts.arrived + status.counts.late;
  view.skipped = status.skipped + status.counts.late;
  view.reconnects = status.counts.reconnects;
  view.latency_ms = kMs * status.latency.median_s;
  view.latency_p95_ms = kMs * status.latency.p95_s;
  return view;
}

/// `live` must outlive the view's page.
void Show(const LiveRun& live, RunView* view, LiveHooks* hooks) {
  hooks->say = [view](const std::string& line) { view->model().AddEvent(line); };
  view->model().AskForFeed([&live] { return FeedOf(live.status()); });
}
#endif

/// Empty unless the machine was too slow for what came, and the images can be made smaller.
std::string AdviceAfter(const FinishedRun& run) {
  constexpr double kManyOvertaken = 0.05;
  constexpr int kEnoughPixels = 200'000;
  const auto came = static_cast<double>(run.facts.live->arrived);
  const double most_pixels = std::stod(run.facts.options.at("features.network_pixels"));
  const bool can_be_smaller = (most_pixels == 0 || most_pixels > kEnoughPixels) &&
                              run.camera.width * run.camera.height > kEnoughPixels;
  if (!can_be_smaller || run.result.skipped_late <= kManyOvertaken * came) return "";
  return fmt::format(
      "--set features.network_pixels={} has the network see smaller images: fewer would be "
      "overtaken\n",
      kEnoughPixels);
}

std::string DescribeLive(const FinishedRun& run) {
  const LiveFacts& live = *run.facts.live;
  return fmt::format(
      "{} images arrived, {} overtaken by newer ones, {} frozen, {} of other proportions; the link "
      "came back {} times\npose {:.1f} ms after the image (median; 95 %: {:.1f} ms)\n",
      live.arrived + live.late, run.result.skipped_late + live.late, live.frozen, live.misfits,
      live.reconnects, 1e3 * live.median_latency_s, 1e3 * live.p95_latency_s);
}

void Run(const LiveArguments& arguments) {
  LogToStderr(arguments.log_level);
  OptionArguments options = arguments.options;
  if (arguments.localise_only) options.assignments.push_back("system.localise_only=true");
  auto settings = ReadRunSettings(options);
#if DEEPUAV_WITH_MAVLINK
  const SensorUseOptions sensors = settings->options.system.sensors;
#endif
  MakeOutputFolder(arguments.out);
  const FolderLock lock(arguments.out);
  ProbeOutput(std::filesystem::path(arguments.out) / "summary.json");
  LiveRun live(arguments.request, std::move(settings));
  CatchSignals();
  LiveHooks hooks;
  hooks.stop = [] { return SignalReceived() != 0; };
  hooks.out = arguments.out;
  hooks.save_every_s = arguments.save_every_s;
  ObserverList observers;
  hooks.observer = &observers;
#if DEEPUAV_WITH_MAVLINK
  const auto autopilot = StartAutopilot(arguments.autopilot, arguments.request, sensors, &live);
  if (autopilot) {
    AutopilotObserver* const observer = autopilot->observer();
    observers.Add(observer);
    hooks.arrived = [observer](Timestamp time, const Stopwatch& since_arrival) {
      observer->Arrived(time, since_arrival);
    };
    if (autopilot->watch()) observers.Add(autopilot->watch());
  }
#endif
#if DEEPUAV_WITH_REPORT
  const auto view = StartView(arguments.view, live.SourceName());
  if (view) Show(live, view.get(), &hooks);
#endif
  live.LearnLens(hooks);
#if DEEPUAV_WITH_REPORT
  if (view) observers.Add(view->Observe(live.working_camera()));  // It draws by the camera.
#endif
  const FinishedRun run = live.Run(hooks);
  if (run.result.frames.empty()) ExitIfInterrupted();  // An earlier run's files are worth more.
  WriteRunOutput(arguments.out, run);
  std::cout << DescribeRun(run.atlas, run.result, run.facts) << DescribeLive(run)
            << AdviceAfter(run);
  if (!run.result.failure.empty())
    throw Error("{} (what was computed is in {})", run.result.failure, arguments.out);
  ExitIfInterrupted();
  if (run.result.frames.empty()) throw Error("{}: no image came", live.SourceName());
  if (run.atlas.Remaining().empty())
    throw Error("{}: no map was started: {}", live.SourceName(), run.result.frames.back().reason);
}

CLI::Validator Seconds() {
  return NumberThat([](double value) { return value >= 0 && value <= kMostSeconds; },
                    "0 to 86400 seconds");
}

void AddSourceArguments(CLI::App& command, LiveArguments& arguments) {
  command
      .add_option("SOURCE", arguments.request.source,
                  "Camera (/dev/video0), address (rtsp://, rtp://, udp://, http://, https://, or a "
                  "session description .sdp), video file or dataset")
      ->required()
      ->check(NamedPath());
  command.add_option("--camera", arguments.request.camera,
                     "Calibration (camera.yaml); without one the dataset's, or a guess");
  command
      .add_option("--learn-lens", arguments.request.lens.longest_s,
                  "Seconds for which a source without calibration is looked at, at most, for its "
                  "lens before tracking begins; 0: the guess is taken")
      ->check(Seconds())
      ->capture_default_str();
  command
      .add_option("--clock", arguments.request.clock,
                  "Times of the images: of their arrival, of the stream, or auto (files: stream)")
      ->check(CLI::IsMember({"auto", "arrival", "stream"}))
      ->capture_default_str();
  command.add_flag("--loop", arguments.request.pace.loop,
                   "A file or dataset begins anew after its end, again and again");
  command.add_option("--speed", arguments.request.pace.speed, "A file's seconds a second")
      ->check(
          NumberThat([](double value) { return value >= 0.01 && value <= 1000; }, "0.01 to 1000"))
      ->capture_default_str();
  command
      .add_option("--timeout", arguments.request.stream.timeout_s,
                  "Seconds without an image after which the link counts as dropped")
      ->check(NumberThat([](double value) { return value >= 0.1 && value <= kMostSeconds; },
                         "0.1 to 86400 seconds"))
      ->capture_default_str();
}

void AddArguments(CLI::App& command, LiveArguments& arguments) {
  AddSourceArguments(command, arguments);
  command.add_option("--out", arguments.out, "Folder for the results, made if absent")
      ->required()
      ->check(NamedOutput());
  command
      .add_option("--save-every", arguments.save_every_s,
                  "Seconds after which what there is is saved into it; 0: at the end only")
      ->check(Seconds())
      ->capture_default_str();
  AddOptionArguments(command, arguments.options);
  AddFeaturesArguments(command, arguments.options);
  AddPrecisionArgument(command, arguments.options);
  command.add_option("--map", arguments.request.map,
                     "Go on with the maps of an earlier run (its map.deepuav)");
  command
      .add_flag("--localise-only", arguments.localise_only,
                "Find the camera in these maps and leave them as they are")
      ->needs("--map");
#if DEEPUAV_WITH_MAVLINK
  AddAutopilotArguments(command, arguments.autopilot);
#endif
#if DEEPUAV_WITH_REPORT
  AddViewArguments(command, arguments.view);
#endif
  AddLogLevelArgument(command, arguments.log_level);
}

}  // namespace

void AddLiveCommand(CLI::App& app) {
  auto arguments = std::make_shared<LiveArguments>();
  CLI::App* command = app.add_subcommand("live", "SLAM over a camera or a stream as it comes");
  command->footer(
      "Example:\n  deepuav live rtsp://10.0.0.2/front --camera camera.yaml --out out/flight\n"
      "Ends, with all saved, on SIGINT, SIGTERM or SIGHUP, or at the end of a file.");
  AddArguments(*command, *arguments);
  command->callback([arguments] { Run(*arguments); });
}

}  // namespace deepuav
