#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/base/ids.h"
#include "deepuav/base/time.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// A frame of a run as its output folder tells it.
struct RecordedFrame {
  FrameId id;
  Timestamp time;
  std::string state, reason;
  int64_t map = -1;  ///< As numbered in map.deepuav; -1 without a pose.
  int key_points = 0, landmarks = 0;
  KeyframeId keyframe;  ///< Invalid where it became none, or none that stayed.
  std::optional<SE3> world_from_cam;
};

/// Reads frames.csv and the trajectories beside it. Throws Error naming file and line where they
/// are not as a run leaves them. `main_map`: whose frames trajectory.txt holds.
std::vector<RecordedFrame> ReadRecordedFrames(const std::filesystem::path& folder,
                                              int64_t main_map);

}  // namespace deepuav
