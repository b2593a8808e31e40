#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "commands.h"
#include "deepuav/base/error.h"
#include "deepuav/evaluation/evaluation.h"
#include "deepuav/evaluation/evaluation_report.h"
#include "deepuav/evaluation/trajectory_plot.h"
#include "deepuav/evaluation/truth.h"
#include "deepuav/io/atomic_file.h"
#include "deepuav/io/text_file.h"

namespace deepuav {
namespace {

constexpr const char* kStdout = "-";

struct EvalArguments {
  std::filesystem::path truth, estimate;
  std::string alignment = "sim3", rpe_unit = "frames", json, plot;
  EvaluationOptions options;
};

// CLI11's own checks name the largest double in full.
CLI::Validator NumberThat(bool (*suits)(double), const char* expected) {
  return CLI::Validator(
      [=](const std::string& text) {
        double number = 0;
        if (IsNumber(text, &number) && suits(number)) return std::string();
        return fmt::format("{}: expected {}", Quoted(text), expected);
      },
      "");
}

const CLI::Validator kPositive =
    NumberThat([](double number) { return number > 0; }, "a number above 0");
const CLI::Validator kNotNegative =
    NumberThat([](double number) { return number >= 0; }, "a number of at least 0");

void AddArguments(CLI::App& command, EvalArguments& arguments) {
  EvaluationOptions& options = arguments.options;
  command.add_option("TRUTH", arguments.truth, "Trajectory file, or dataset folder with its truth")
      ->required()
      ->check(CLI::ExistingPath);
  command.add_option("ESTIMATE", arguments.estimate, "Trajectory file")
      ->required()
      ->check(CLI::ExistingFile);
  command.add_option("--align", arguments.alignment, "Alignment before comparing")
      ->check(CLI::IsMember({"sim3", "se3", "yaw", "none"}))
      ->capture_default_str();
  command
      .add_option("--max-difference", options.association.max_difference_s,
                  "Largest difference of associated time stamps, s")
      ->check(kNotNegative)
      ->capture_default_str();
  command
      .add_option("--time-offset", options.association.time_offset_s,
                  "Added to the estimate's time stamps, s")
      ->capture_default_str();
  command.add_flag("--one-to-one", options.association.one_to_one,
                   "Let no pose be associated twice");
  command.add_flag("--horizontal", options.horizontal,
                   "Errors in x and y alone; altitudes of photographs are not used");
  command.add_option("--start", options.start_s, "Evaluate from here on, s from the first truth")
      ->check(kNotNegative)
      ->capture_default_str();
  command.add_option("--end", options.end_s, "Evaluate to here, s from the first truth")
      ->check(kPositive);
}

void AddRelativeAndOutputArguments(CLI::App& command, EvalArguments& arguments) {
  RpeOptions& rpe = arguments.options.rpe;
  command.add_option("--rpe-delta", rpe.delta, "Step of the relative pose error")
      ->check(kPositive)
      ->capture_default_str();
  command.add_option("--rpe-unit", arguments.rpe_unit, "Unit of the step")
      ->check(CLI::IsMember({"frames", "m", "s"}))
      ->capture_default_str();
  command.add_flag("--rpe-all-pairs", rpe.all_pairs, "A step from every pose, not end to end");
  command.add_flag("--rpe-pairs-from-truth", rpe.pairs_from_truth,
                   "Measure steps in metres along the truth, not the estimate");
  command.add_option("--json", arguments.json, "Write all figures as JSON (- for stdout)");
  command.add_option("--plot", arguments.plot, "Write the trajectories and errors as SVG");
}

void Eval(EvalArguments arguments) {
  EvaluationOptions& options = arguments.options;
  options.alignment = ParseAlignment(arguments.alignment);
  options.rpe.unit = ParseRpeUnit(arguments.rpe_unit);
  try {
    options.Check();
  } catch (const Error& error) {
    throw CLI::ValidationError(error.what());
  }

  const Truth truth = LoadTruth(arguments.truth, !options.horizontal);
  const Trajectory estimate = ReadTrajectory(arguments.estimate);
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
  AddArguments(*command, *arguments);
  AddRelativeAndOutputArguments(*command, *arguments);
  command->footer(
      "Examples:\n"
      "  deepuav eval MH_01_easy out/trajectory.txt --align sim3 --plot errors.svg\n"
      "  deepuav eval groundtruth.txt out/trajectory.txt --rpe-delta 1 --rpe-unit m --json -\n"
      "  deepuav eval photographs/ out/trajectory.txt --horizontal");
  command->callback([arguments] { Eval(*arguments); });
}

}  // namespace deepuav
