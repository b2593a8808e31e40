#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "arguments/argument_checks.h"
#include "arguments/evaluation_arguments.h"
#include "commands/commands.h"
#include "deepuav/base/logging.h"
#include "deepuav/evaluation/drawing/trajectory_plot.h"
#include "deepuav/evaluation/measures/evaluation.h"
#include "deepuav/evaluation/measures/truth.h"
#include "deepuav/evaluation/report/evaluation_report.h"
#include "deepuav/io/files/atomic_file.h"

namespace deepuav {
namespace {

constexpr const char* kStdout = "-";

struct EvalArguments {
  std::filesystem::path truth, estimate;
  std::string json, plot;
  EvaluationArguments evaluation;
};

/// Before the work, not after it, it shows that an output cannot be written.
void CheckOutputs(const EvalArguments& arguments) {
  for (const std::string& output : {arguments.json, arguments.plot}) {
    if (output == kStdout) continue;
    RefuseInputAsOutput(output, {arguments.truth, arguments.estimate});
    ProbeOutput(output);
  }
}

void Eval(EvalArguments arguments) {
  LogToStderr("warn");
  FinishEvaluationArguments(&arguments.evaluation);
  const EvaluationOptions& options = arguments.evaluation.options;
  const Truth truth = LoadTruth(arguments.truth, arguments.evaluation.truth_options);
  const Trajectory estimate = LoadEstimate(arguments.estimate, truth);
  CheckOutputs(arguments);
  const Evaluation evaluation = EvaluateTrajectory(truth, estimate, options);

  const std::string json = EvaluationJson(evaluation, options).dump(2) + "\n";
  std::cout << (arguments.json == kStdout ? json : EvaluationTable(evaluation, options));
  if (!arguments.json.empty() && arguments.json != kStdout)
    WriteFileAtomically(arguments.json, json);
  if (!arguments.plot.empty())
    WriteFileAtomically(arguments.plot, PlotTrajectories(evaluation, options));
}

}  // namespace

void AddEvalCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "eval", "Compare a trajectory with the truth: absolute and relative pose errors");
  const auto arguments = std::make_shared<EvalArguments>();
  command
      ->add_option("TRUTH", arguments->truth,
                   "Trajectory, file of position fixes, or dataset folder with its truth")
      ->required()
      ->check(NamedPath());
  command->add_option("ESTIMATE", arguments->estimate, "Trajectory file")
      ->required()
      ->check(NamedPath());
  AddEvaluationArguments(command, &arguments->evaluation);
  command->add_option("--json", arguments->json, "Write all figures as JSON (- for stdout)")
      ->check(NamedPath());
  command->add_option("--plot", arguments->plot, "Write the trajectories and errors as SVG")
      ->check(NamedOutput());
  command->footer(
      "Examples:\n"
      "  deepuav eval MH_01_easy out/trajectory.txt --align sim3 --plot errors.svg\n"
      "  deepuav eval groundtruth.txt out/trajectory.txt --rpe-delta 1 --rpe-unit m --json -\n"
      "  deepuav eval photographs/ out/trajectory.txt\n"
      "  deepuav eval flight.gpx out/trajectory.txt --search-offset 5 --lever-arm 0.1,-0.05,0");
  command->callback([arguments] { Eval(*arguments); });
}

}  // namespace deepuav
