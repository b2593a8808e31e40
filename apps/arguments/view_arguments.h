#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
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
  /// Says on stderr where the page is.
  RunView(const ViewArguments& arguments, const std::string& title);

  /// What shows a run, once it begins. `camera`: of the images as the run works on them.
  RunObserver* Observe(const Camera& camera) { return &observer_.emplace(camera, &model_); }
  ViewModel& model() { return model_; }

 private:
  ViewModel model_;
  std::optional<ViewObserver> observer_;
  ViewServer server_;
};

/// Null where no page was asked for.
std::unique_ptr<RunView> StartView(const ViewArguments& arguments, const std::string& title);

/// Says on stderr where the page is.
void TellWhere(const ViewServer& server);

}  // namespace deepuav
