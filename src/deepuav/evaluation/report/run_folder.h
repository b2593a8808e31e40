#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "deepuav/io/geodata/trajectory.h"
#include "deepuav/io/maps/point_cloud.h"

namespace deepuav {

/// Frames without a pose that have their reason in common.
struct LostFrames {
  std::string reason;  ///< N stands for its numbers.
  int count = 0;
  int64_t first = 0, last = 0;  ///< Numbers of frames.
};

/// What `deepuav run` wrote into its output folder, but for the map.
struct RunFolder {
  std::filesystem::path path;
  std::string name;  ///< The folder's own.
  nlohmann::ordered_json summary;
  Trajectory trajectory, keyframes;  ///< Of the main map; empty where no map was started.
  std::vector<std::pair<std::string, std::vector<double>>> stage_ms;  ///< In the file's order.
  std::vector<ColouredPoint> points;
  std::vector<LostFrames> lost;  ///< The most frequent reason first.

  /// The summary's text at a path of keys as "/dataset/path", or nothing.
  std::string Text(const std::string& pointer) const;
};

/// Reads the folder of a run. Only summary.json and trajectory.txt must be there. Throws Error
/// naming the file and what is wrong in it.
RunFolder ReadRunFolder(const std::filesystem::path& path);

/// The folders' names, with as many parents before them as tell them apart.
void MakeNamesUnique(std::vector<RunFolder>* runs);

}  // namespace deepuav
