#include "arguments/view_arguments.h"

#include <iostream>

namespace deepuav {

void AddServerArguments(CLI::App& command, ViewArguments& arguments) {
  constexpr int kMostPort = 65535;
  command.add_option("--port", arguments.server.port, "Of the page; 0: any that is free")
      ->check(CLI::Range(0, kMostPort).description(""))
      ->capture_default_str();
  command
      .add_option("--listen", arguments.server.listen,
                  "Address of this machine that the page is served at; unless only this machine "
                  "reaches it, a token is needed, which is printed")
      ->capture_default_str();
}

void AddViewArguments(CLI::App& command, ViewArguments& arguments) {
  command.add_flag("--view", arguments.view, "Serve a page that shows the run as it goes on");
  AddServerArguments(command, arguments);
}

void TellWhere(const ViewServer& server) { std::cerr << "watch at " << server.Url() << std::endl; }

RunView::RunView(const ViewArguments& arguments, const std::string& title)
    : model_(title), server_(&model_, arguments.server) {
  TellWhere(server_);
}

std::unique_ptr<RunView> StartView(const ViewArguments& arguments, const std::string& title) {
  return arguments.view ? std::make_unique<RunView>(arguments, title) : nullptr;
}

}  // namespace deepuav
