#include "arguments/evaluation_arguments.h"

#include <string>
#include <vector>

#include "arguments/argument_checks.h"
#include "arguments/option_bounds_check.h"
#include "deepuav/base/error.h"
#include "deepuav/evaluation/report/evaluation_report.h"

namespace deepuav {
namespace {

CLI::Validator BoundsOf(const std::string& option) {
  return WithinBoundsOf<EvaluationOptions>(option);
}

void AddComparisonArguments(CLI::App& command, EvaluationArguments& arguments) {
  EvaluationOptions& options = arguments.options;
  command.add_option("--align", arguments.alignment, "Alignment before comparing")
      ->check(CLI::IsMember({"sim3", "se3", "yaw", "none"}))
      ->capture_default_str();
  command
      .add_option("--max-difference", options.association.max_difference_s,
                  "Largest difference of associated time stamps, s")
      ->check(BoundsOf("max_difference_s"))
      ->capture_default_str();
  command
      .add_option("--time-offset", options.association.time_offset_s,
                  "Added to the estimate's time stamps, s")
      ->check(BoundsOf("time_offset_s"))
      ->capture_default_str();
  command
      .add_option("--search-offset", options.search_offset_s,
                  "Search the time offset this far both ways, s")
      ->check(BoundsOf("search_offset_s"));
  command
      .add_option("--lever-arm", arguments.lever_arm_m,
                  "x,y,z: where in the camera (right, down, forward) the antenna is, m")
      ->delimiter(',')
      ->expected(3);
  command.add_flag("--interpolate", options.association.interpolate,
                   "Interpolate the estimate at the truth's moments");
  command
      .add_option("--max-gap", options.association.max_gap_s,
                  "Longest gap of the estimate to interpolate in, s")
      ->check(BoundsOf("max_gap_s"))
      ->capture_default_str();
  command.add_flag("--one-to-one", options.association.one_to_one,
                   "Let no pose be associated twice");
  command.add_flag("--horizontal", options.horizontal, "Errors in x and y alone");
  command.add_flag("--photograph-altitude", arguments.truth_options.photograph_altitude,
                   "Use the altitudes of photographs, which are left out otherwise");
  command.add_option("--start", options.start_s, "Evaluate from here on, s from the first truth")
      ->check(BoundsOf("start_s"))
      ->capture_default_str();
  command.add_option("--end", options.end_s, "Evaluate to here, s from the first truth")
      ->check(NumberThat([](double number) { return number > 0; }, "a number above 0"));
}

void AddRelativeArguments(CLI::App& command, EvaluationArguments& arguments) {
  RpeOptions& rpe = arguments.options.rpe;
  command.add_option("--rpe-delta", rpe.delta, "Step of the relative pose error")
      ->check(BoundsOf("rpe.delta"))
      ->capture_default_str();
  command.add_option("--rpe-unit", arguments.rpe_unit, "Unit of the step")
      ->check(CLI::IsMember({"frames", "m", "s"}))
      ->capture_default_str();
  command.add_flag("--rpe-all-pairs", rpe.all_pairs, "A step from every pose, not end to end");
  command.add_flag("--rpe-pairs-from-truth", rpe.pairs_from_truth,
                   "Measure steps in metres along the truth, not the estimate");
}

}  // namespace

void AddEvaluationArguments(CLI::App* command, EvaluationArguments* arguments) {
  AddComparisonArguments(*command, *arguments);
  AddRelativeArguments(*command, *arguments);
}

void FinishEvaluationArguments(EvaluationArguments* arguments) {
  EvaluationOptions& options = arguments->options;
  options.alignment = ParseAlignment(arguments->alignment);
  options.rpe.unit = ParseRpeUnit(arguments->rpe_unit);
  if (!arguments->lever_arm_m.empty())
    options.antenna_cam_m = Eigen::Vector3d::Map(arguments->lever_arm_m.data());
  if (options.end_s <= options.start_s) {
    throw CLI::ValidationError(
        fmt::format("--end is {}: expected more than --start, {}", options.end_s, options.start_s));
  }
  try {
    options.Check();
  } catch (const Error& error) {
    throw CLI::ValidationError(error.what());
  }
}

}  // namespace deepuav
