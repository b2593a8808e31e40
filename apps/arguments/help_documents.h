#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace deepuav {

/// What --help tells of the program and all its commands, as a manual page (roff, section 1).
std::string ManualPage(const CLI::App& app, const std::string& version);

/// A script that completes commands, options and their values for "bash" or "zsh".
std::string CompletionScript(const CLI::App& app, const std::string& shell);

/// `completion` and `manual`, which print these.
void AddHelpDocumentCommands(CLI::App& app);

}  // namespace deepuav
