#include <algorithm>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>

#include "arguments/argument_checks.h"
#include "arguments/option_arguments.h"
#include "arguments/option_bounds_check.h"
#include "commands/commands.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/base/time.h"
#include "deepuav/io/files/folder_lock.h"
#include "deepuav/io/files/options_file.h"
#include "simulated/simulated_dataset.h"
#include "simulated/simulation_options.h"
#include "work/interruption.h"
#include "work/progress_bar.h"

namespace deepuav {
namespace {

/// What the command line says.
struct SimulateArguments {
  SimulationChoice choice;
  std::string out, log_level = "info";
  std::optional<int> seed;
  int frames = -1;
  int threads = 0;
  double orthophoto_cell_m = 0;
  bool moving_mask = false;
  bool list = false;
};

void List() {
  std::cout << "flights:\n";
  for (const ListedFlight& flight : ListFlights())
    std::cout << fmt::format("  {:<14} {}\n", flight.name, flight.about);
  std::cout << "scenes:\n";
  for (const std::string& scene : SceneNames()) std::cout << "  " << scene << "\n";
}

/// Options that are unknown or impossible are wrong use.
void ReadOptions(const SimulateArguments& arguments, SimulationOptions* options,
                 OptionRegistry* registry) try {
  options->Register(registry);
  SimulationChoice choice = arguments.choice;
  if (arguments.seed)
    choice.assignments.push_back("flight.seed=" + std::to_string(*arguments.seed));
  LoadSimulation(choice, options, registry);
} catch (const Error& error) {
  throw CLI::ValidationError(error.what());
}

/// Returns how many frames are there in the end; fewer than `frames` after a signal.
int WriteFrames(int frames, SimulatedDataset* dataset) {
  ProgressBar bar(frames);
  int done = 0;
  for (; done < frames && SignalReceived() == 0; ++done) {
    const bool rendered = dataset->WriteFrame(done);
    bar.Advance(done + 1, rendered ? "rendering" : "there already");
  }
  return done;
}

void Simulate(const SimulateArguments& arguments) {
  if (arguments.list) return List();
  if (arguments.choice.flight.empty() || arguments.out.empty())
    throw CLI::ValidationError("--flight and --out are required (or --list)");
  LogToStderr(arguments.log_level);
  SimulationOptions options;
  OptionRegistry registry;
  ReadOptions(arguments, &options, &registry);

  SimulatedDataset dataset(options, arguments.out, arguments.threads);
  MakeOutputFolder(arguments.out);
  const FolderLock lock(arguments.out);
  dataset.WriteSensors(OptionsAsYaml(registry));
  if (arguments.moving_mask) dataset.AddMovingMasks();
  CatchSignals();
  const int frames = arguments.frames < 0 ? dataset.frame_count()
                                          : std::min(arguments.frames, dataset.frame_count());
  const Stopwatch rendering;
  const int done = WriteFrames(frames, &dataset);
  dataset.WriteFrameList(done);
  if (arguments.orthophoto_cell_m > 0 && SignalReceived() == 0)
    dataset.WriteOrthophoto(done, arguments.orthophoto_cell_m);
  std::cout << fmt::format("{} of {} frames in {}, {:.1f} s of flight, in {:.1f} s\n", done,
                           dataset.frame_count(), arguments.out, dataset.duration_s(),
                           rendering.Seconds());
  ExitIfInterrupted();
}

void AddArguments(CLI::App& command, SimulateArguments& arguments) {
  constexpr double kLargestCell_m = 1000;
  command.add_option("--flight", arguments.choice.flight, "Name of a flight, or its YAML file");
  command.add_option("--scene", arguments.choice.scene,
                     "Name of a scene, or its YAML file; default: the flight's");
  command.add_option("--out", arguments.out, "Folder for the dataset, made if absent")
      ->check(NamedOutput());
  command.add_option("--seed", arguments.seed, "Seed of wind and noise; default: the flight's")
      ->check(CLI::Range(0, std::numeric_limits<int>::max()).description(""));
  command
      .add_option("--set", arguments.choice.assignments,
                  "One option as name=value; may be repeated")
      ->allow_extra_args(false);
  command.add_option("--frames", arguments.frames, "Render at most this many; -1: all")
      ->check(NumberOfFrames())
      ->capture_default_str();
  command.add_option("--threads", arguments.threads, "Threads that render; 0: one a core")
      ->check(CLI::Range(0, 1024).description(""))
      ->capture_default_str();
  command
      .add_option("--orthophoto", arguments.orthophoto_cell_m,
                  "Write the true orthophoto and DSM below the flight, in cells of so many metres")
      ->check(WithinBounds(Above(0, kLargestCell_m)));
  command.add_flag("--moving-mask", arguments.moving_mask,
                   "Write which pixels show moving things, also beside frames that are there");
  command.add_flag("--list", arguments.list, "List the flights and scenes, and do nothing else");
  AddLogLevelArgument(command, arguments.log_level);
}

}  // namespace

void AddSimulateCommand(CLI::App& app) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command = app.add_subcommand(
      "simulate", "Render a drone's flight with exact truth, as a dataset of EuRoC's layout");
  command->footer(
      "Examples:\n"
      "  deepuav simulate --list\n"
      "  deepuav simulate --flight orbit --out data/orbit\n"
      "  deepuav simulate --flight my.yaml --scene desert --out data/my --set course.height_m=60\n"
      "A flight that was interrupted goes on when the same command is given again.");
  AddArguments(*command, *arguments);
  command->callback([arguments] { Simulate(*arguments); });
}

}  // namespace deepuav
