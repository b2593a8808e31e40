#include <cstdlib>
#include <iostream>
#include <opencv2/core/utils/logger.hpp>

#include "commands.h"
#include "deepuav/base/error.h"
#include "deepuav/io/text_file.h"

namespace {

constexpr int kFailure = 1, kWrongUse = 2;

// What OpenCV and FFmpeg say of a damaged image, the program says in one line of its own.
void SilenceLibraries() {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  constexpr char kQuiet[] = "-8";  // AV_LOG_QUIET
  constexpr int kKeepTheUsers = 0;
  ::setenv("OPENCV_FFMPEG_LOGLEVEL", kQuiet, kKeepTheUsers);
}

std::string WrongUseMessage(const CLI::App* /*app*/, const CLI::Error& error) {
  return fmt::format("deepuav: {} (--help shows the use)\n", deepuav::OneLine(error.what()));
}

}  // namespace

int main(int argc, char** argv) {
  SilenceLibraries();
  CLI::App app("Deep-UAV SLAM: monocular SLAM for drones with learned features", "deepuav");
  app.set_version_flag("--version", DEEPUAV_VERSION);
  app.require_subcommand(1);
  app.failure_message(WrongUseMessage);
  deepuav::AddRunCommand(app);
  deepuav::AddEvalCommand(app);
  deepuav::AddSimulateCommand(app);
  deepuav::AddReportCommand(app);
  deepuav::AddMapCommand(app);
  deepuav::AddTrainVocabCommand(app);
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUse;
  } catch (const deepuav::ExitStatus& exit) {
    return exit.status;
  } catch (const std::exception& error) {
    std::cerr << "deepuav: " << deepuav::OneLine(error.what()) << "\n";
    return kFailure;
  }
}
