#include <iostream>

#include "commands.h"
#include "deepuav/base/error.h"

namespace {

constexpr int kFailure = 1, kWrongUse = 2;

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Deep-UAV SLAM: monocular SLAM for drones with learned features", "deepuav");
  app.set_version_flag("--version", DEEPUAV_VERSION);
  app.require_subcommand(1);
  deepuav::AddRunCommand(app);
  deepuav::AddEvalCommand(app);
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUse;
  } catch (const deepuav::ExitStatus& exit) {
    return exit.status;
  } catch (const std::exception& error) {
    std::cerr << "deepuav: " << error.what() << "\n";
    return kFailure;
  }
}
