#pragma once

#include <filesystem>
#include <string>

#include "deepuav/base/options.h"

namespace deepuav {

/// Sets the options that a YAML file of nested mappings names ("tracking:" over "keypoints: 800"
/// sets tracking.keypoints; dotted keys do too). Throws Error naming file, line and option: an
/// unknown one (with the nearest known), one given twice, or a value that is none of its type.
/// Options before the error stay set.
void LoadOptionsFile(const std::filesystem::path& file, OptionRegistry* options);

/// The options as YAML that LoadOptionsFile reads, each with its unit, meaning and bounds as a
/// comment.
std::string OptionsAsYaml(const OptionRegistry& options);

}  // namespace deepuav
