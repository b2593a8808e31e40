#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "deepuav/io/maps/map_file.h"
#include "deepuav/viewer/recorded_frames.h"
#include "deepuav/viewer/view_model.h"

namespace deepuav {

struct ReplayOptions {
  double speed = 1;       ///< Seconds of the run a second.
  double most_gap_s = 1;  ///< A longer time without frames is waited for so long.
  double pause_s = 3;     ///< Before it begins anew.
};

/// Shows a recorded run again, from its output folder.
class Replay {
 public:
  /// `model` must outlive it. Throws Error naming the file that cannot be read.
  Replay(const std::filesystem::path& folder, const ReplayOptions& options, ViewModel* model);

  /// Again and again until `stop` says true.
  void Run(const std::function<bool()>& stop);

 private:
  void ShowFrame(const RecordedFrame& frame);
  void ShowMap(const RecordedFrame& frame);
  void AddPicture(const RecordedFrame& recorded, FrameView* view) const;

  const ReplayOptions options_;
  ViewModel* const model_;
  LoadedAtlas loaded_;
  std::vector<MapId> maps_;  ///< By their numbers in the file.
  std::vector<RecordedFrame> frames_;
  std::vector<Eigen::Vector3f> path_;  ///< In `path_map_`, up to now.
  int64_t path_map_ = -1;
  KeyframeId newest_{-1};
  Stopwatch since_map_;
};

}  // namespace deepuav
