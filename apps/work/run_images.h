#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "deepuav/io/datasets/dataset.h"

namespace deepuav {

/// The images that a map was made of: those that the command line names, else those of the run
/// that wrote the map.
struct RunImages {
  std::string named;  ///< Empty where not given.
  std::filesystem::path map_file;

  /// Throws Error where nothing tells them, or they are gone.
  std::unique_ptr<Dataset> Open() const;
};

/// --images.
void AddImagesArgument(CLI::App& command, RunImages& images);

}  // namespace deepuav
