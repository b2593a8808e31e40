#pragma once

#include <CLI/CLI.hpp>

namespace deepuav {

/// Ends the program with this status after everything was saved, as after a signal.
struct ExitStatus {
  int status;
};

// Each adds one subcommand, whose callback does the work; an Error thrown there ends the program
// with one line on stderr and status 1.
void AddRunCommand(CLI::App& app);
void AddEvalCommand(CLI::App& app);
void AddSimulateCommand(CLI::App& app);
void AddReportCommand(CLI::App& app);
void AddMapCommand(CLI::App& app);
void AddTrainVocabCommand(CLI::App& app);

}  // namespace deepuav
