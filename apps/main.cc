#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <opencv2/core/utils/logger.hpp>

#include "arguments/argument_checks.h"
#include "arguments/help_documents.h"
#include "commands/commands.h"
#include "deepuav/assembly/settings/wrong_use.h"
#include "deepuav/io/files/text_file.h"
#include "work/interruption.h"

namespace {

constexpr int kFailure = 1, kWrongUse = 2;

// What OpenCV and FFmpeg say of a damaged image, the program says in one line of its own.
void SilenceLibraries() {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  constexpr char kQuiet[] = "-8";  // AV_LOG_QUIET
  constexpr int kKeepTheUsers = 0;
  ::setenv("OPENCV_FFMPEG_LOGLEVEL", kQuiet, kKeepTheUsers);
}

std::string WrongUseLine(const std::string& message) {
  return fmt::format("deepuav: {} (--help shows the use)\n", deepuav::OneLine(message));
}

std::string WrongUseMessage(const CLI::App* /*app*/, const CLI::Error& error) {
  return WrongUseLine(error.what());
}

/// Output may still wait in a buffer, and a full disk behind it is a failure like any other.
int FinishOutput(int status) {
  std::cout.flush();
  const bool is_written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout;
  if (is_written || status != 0) return status;
  std::cerr << "deepuav: stdout: cannot be written\n";
  return kFailure;
}

}  // namespace

namespace deepuav {

int RunProgram(std::vector<std::string> words) {
  CLI::App app("Deep-UAV SLAM: monocular SLAM for drones with learned features", "deepuav");
  app.set_version_flag("--version", DEEPUAV_VERSION);
  app.require_subcommand(1);
  app.failure_message(WrongUseMessage);
#if DEEPUAV_WITH_SIMULATION && DEEPUAV_WITH_REPORT
  AddDemoCommand(app);
#endif
  AddRunCommand(app);
  AddLiveCommand(app);
  AddEvalCommand(app);
#if DEEPUAV_WITH_REPORT
  AddReportCommand(app);
  AddViewCommand(app);
#endif
#if DEEPUAV_WITH_SIMULATION
  AddSimulateCommand(app);
#endif
  AddMapCommand(app);
  AddMatchCommand(app);
  AddTrainVocabCommand(app);
  AddModelsCommand(app);
  AddOptionsCommand(app);
  AddBenchCommand(app);
  AddHelpDocumentCommands(app);
  try {
    std::reverse(words.begin(), words.end());  // as the parser wants them
    app.parse(std::move(words));
    return 0;
  } catch (const CLI::RequiredError& error) {
    const std::string unknown = UnknownCommandMessage(app);
    if (unknown.empty()) return app.exit(error) == 0 ? 0 : kWrongUse;
    std::cerr << WrongUseLine(unknown);
    return kWrongUse;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUse;
  } catch (const WrongUse& error) {
    std::cerr << WrongUseLine(error.what());
    return kWrongUse;
  } catch (const ExitStatus& exit) {
    return exit.status;
  } catch (const std::exception& error) {
    std::cerr << "deepuav: " << OneLine(error.what()) << "\n";
    return kFailure;
  }
}

}  // namespace deepuav

int main(int argc, char** argv) {
  SilenceLibraries();
  deepuav::CleanUpOnSignals();
  return FinishOutput(deepuav::RunProgram({argv + 1, argv + argc}));
}
