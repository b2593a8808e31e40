#include <memory>

#include "arguments/argument_checks.h"
#include "arguments/option_arguments.h"
#include "arguments/view_arguments.h"
#include "commands/commands.h"
#include "deepuav/viewer/replay.h"
#include "work/interruption.h"

namespace deepuav {
namespace {

struct ViewCommandArguments {
  std::string out;
  ReplayOptions replay;
  ViewArguments view;
};

void View(const ViewCommandArguments& arguments) {
  ViewModel model(arguments.out);
  Replay replay(arguments.out, arguments.replay, &model);
  const ViewServer server(&model, arguments.view.server);
  TellWhere(server);
  CatchSignals();
  replay.Run([] { return SignalReceived() != 0; });
  ExitIfInterrupted();
}

}  // namespace

void AddViewCommand(CLI::App& app) {
  auto arguments = std::make_shared<ViewCommandArguments>();
  CLI::App* command = app.add_subcommand("view", "Shows a recorded run again on a page");
  command->footer("Example:\n  deepuav view out/mh01\nEnds on SIGINT.");
  command->add_option("OUT", arguments->out, "Output folder of a run")
      ->required()
      ->check(NamedPath());
  command->add_option("--speed", arguments->replay.speed, "The run's seconds a second")
      ->check(
          NumberThat([](double value) { return value >= 0.01 && value <= 1000; }, "0.01 to 1000"))
      ->capture_default_str();
  AddServerArguments(*command, arguments->view);
  command->callback([arguments] { View(*arguments); });
}

}  // namespace deepuav
