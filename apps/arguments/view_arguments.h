#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "deepuav/viewer/view_observer.h"
#include "deepuav/viewer/view_server.h"

namespace deepuav {

/// What the command line says of the page.
struct ViewArguments {
  bool view = false;
  ViewServerOptions server;
};

/// --port and --listen.
void AddServerArguments(CLI::App& command, ViewArguments& arguments);
/// The same and --view.
void AddViewArguments(CLI::App& command, ViewArguments& arguments);

/// The page of a run that goes on: served from the beginning to the end of its life.
class RunView {
 public:
  /// Says on stderr where the page is. `camera`: of the images as the run works on them.
  RunView(const ViewArguments& arguments, const std::string& title, const Camera& camera);

  RunObserver* observer() { return &observer_; }
  ViewModel& model() { return model_; }

 private:
  ViewModel model_;
  ViewObserver observer_;
  ViewServer server_;
};

/// Null where no page was asked for.
std::unique_ptr<RunView> StartView(const ViewArguments& arguments, const std::string& title,
                                   const Camera& camera);

/// Says on stderr where the page is.
void TellWhere(const ViewServer& server);

}  // namespace deepuav
