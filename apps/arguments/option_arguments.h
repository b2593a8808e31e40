#pragma once

#include <memory>
#include <string>
#include <vector>

#include "deepuav/assembly/settings/run_options.h"
#include "deepuav/base/options.h"

namespace CLI {
class App;
}

namespace deepuav {

/// What the command line says of options.
struct OptionArguments {
  std::string config;
  std::vector<std::string> assignments;
  std::string features, model, precision;  ///< Empty where not given.
};

/// --config and --set.
void AddOptionArguments(CLI::App& command, OptionArguments& arguments);
/// --features and --model.
void AddFeaturesArguments(CLI::App& command, OptionArguments& arguments);
/// --log-level.
void AddLogLevelArgument(CLI::App& command, std::string& level);
/// --precision.
void AddPrecisionArgument(CLI::App& command, OptionArguments& arguments);

/// Sets what the file says (if any), then the assignments, among which --features stands for
/// features.size, --model for features.model and --precision for inference.precision. An assigned
/// size takes back the model of the file. Throws Error for what is unknown or given twice.
void SetOptions(const OptionArguments& arguments, OptionRegistry* registry);

/// What the arguments say of a run, as ReadSettings.
std::unique_ptr<RunSettings> ReadRunSettings(const OptionArguments& arguments,
                                             const std::string& best_method = "nearest");

}  // namespace deepuav
