#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "deepuav/io/point_cloud.h"
#include "deepuav/io/trajectory.h"

namespace deepuav {

/// What `deepuav run` wrote into its output folder, but for the map.
struct RunFolder {
  std::filesystem::path path;
  std::string name;  ///< The folder's own.
  nlohmann::ordered_json summary;
  Trajectory trajectory, keyframes;  ///< Of the main map; empty where no map was started.
  std::vector<std::pair<std::string, std::vector<double>>> stage_ms;  ///< In the file's order.
  std::vector<ColoredPoint> points;

  /// The summary's text at a path of keys as "/dataset/path", or nothing.
  std::string Text(const std::string& pointer) const;
};

/// Reads the folder of a run. Only summary.json and trajectory.txt must be there. Throws Error
/// naming the file and what is wrong in it.
RunFolder ReadRunFolder(const std::filesystem::path& path);

/// The folders' names, with as many parents before them as tell them apart.
void MakeNamesUnique(std::vector<RunFolder>* runs);

}  // namespace deepuav
