#pragma once

#include <CLI/CLI.hpp>

namespace deepuav {

/// Adds `merge` to the commands on maps.
void AddMergeCommand(CLI::App& app);

}  // namespace deepuav
