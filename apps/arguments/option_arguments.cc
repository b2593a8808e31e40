#include "arguments/option_arguments.h"

#include <CLI/CLI.hpp>
#include <array>
#include <map>

#include "deepuav/base/error.h"
#include "deepuav/io/files/options_file.h"

namespace deepuav {
namespace {

constexpr char kSize[] = "features.size", kModel[] = "features.model",
               kPrecision[] = "inference.precision";

struct ShortForm {
  const char* argument;
  const char* option;
  const std::string& value;
};

std::string NameOf(const std::string& assignment) {
  return assignment.substr(0, assignment.find('='));
}

}  // namespace

void AddOptionArguments(CLI::App& command, OptionArguments& arguments) {
  command.add_option("--config", arguments.config, "YAML file of options");
  command.add_option("--set", arguments.assignments, "One option as name=value; may be repeated")
      ->allow_extra_args(false);
}

void AddFeaturesArguments(CLI::App& command, OptionArguments& arguments) {
  CLI::Option* features =
      command.add_option("--features", arguments.features,
                         "Shipped SuperPoint network by its size (deepuav models lists them)");
  command.add_option("--model", arguments.model, "SuperPoint network of your own (.onnx or .xml)")
      ->excludes(features);
}

void AddLogLevelArgument(CLI::App& command, std::string& level) {
  command.add_option("--log-level", level, "What is logged to stderr")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
}

void AddPrecisionArgument(CLI::App& command, OptionArguments& arguments) {
  command
      .add_option("--precision", arguments.precision,
                  "Arithmetic of the networks; auto takes what the CPU has in hardware")
      ->check(CLI::IsMember({"auto", "fp32", "bf16", "int8"}));
}

void SetOptions(const OptionArguments& arguments, OptionRegistry* registry) {
  if (!arguments.config.empty()) LoadOptionsFile(arguments.config, registry);
  const std::array<ShortForm, 3> short_forms = {{{"--features", kSize, arguments.features},
                                                 {"--model", kModel, arguments.model},
                                                 {"--precision", kPrecision, arguments.precision}}};
  std::map<std::string, std::string> given;  // by what on the command line, by option
  for (const std::string& assignment : arguments.assignments)
    given[NameOf(assignment)] = "--set " + assignment;
  std::vector<std::string> assignments = arguments.assignments;
  for (const auto& [argument, option, value] : short_forms) {
    if (value.empty()) continue;
    const auto [earlier, is_new] = given.emplace(option, std::string(argument) + " " + value);
    if (!is_new) {
      throw Error("{} {} and {}: expected one of them", argument, value, earlier->second);
    }
    assignments.push_back(std::string(option) + "=" + value);
  }
  if (given.contains(kSize)) {
    if (given.contains(kModel))
      throw Error("{} and {}: expected one of them", given[kSize], given[kModel]);
    registry->Set(kModel, "");
  }
  for (const std::string& assignment : assignments) registry->SetAssignment(assignment);
}

std::unique_ptr<RunSettings> ReadRunSettings(const OptionArguments& arguments,
                                             const std::string& best_method) {
  return ReadSettings([&](OptionRegistry* registry) { SetOptions(arguments, registry); },
                      best_method);
}

}  // namespace deepuav
