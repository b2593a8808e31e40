#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace deepuav {

/// Ends the program with this status after everything was saved, as after a signal.
struct ExitStatus {
  int status;
};

/// Does what the command line says, without the program's name; returns the exit status. Prints,
/// also the one line of an error.
int RunProgram(std::vector<std::string> words);

// Each adds one subcommand, whose callback does the work; an Error thrown there ends the program
// with one line on stderr and status 1.
void AddDemoCommand(CLI::App& app);
void AddRunCommand(CLI::App& app);
void AddLiveCommand(CLI::App& app);
void AddViewCommand(CLI::App& app);
void AddEvalCommand(CLI::App& app);
void AddSimulateCommand(CLI::App& app);
void AddReportCommand(CLI::App& app);
void AddMapCommand(CLI::App& app);
void AddTrainVocabCommand(CLI::App& app);
void AddMatchCommand(CLI::App& app);
void AddModelsCommand(CLI::App& app);
void AddOptionsCommand(CLI::App& app);
void AddBenchCommand(CLI::App& app);

}  // namespace deepuav
