#pragma once

#include <deque>

#include "deepuav/geometry/timed_pose.h"
#include "deepuav/map/map.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

/// Where a camera was, as the map has it now: its poses hang on keyframes, and move and scale with
/// them. Thread-compatible.
class MovingPath {
 public:
  /// Of frames that come closer in time than this the first is taken.
  explicit MovingPath(double interval_s) : interval_s_(interval_s) {}

  /// The next frame, which was located.
  void Add(const FrameRecord& record);
  /// The map as it is now. Those that it has become part of take over what was in it.
  void Follow(const Map& map);
  void ForgetBefore(Timestamp time);
  void Clear() { stops_.clear(); }
  /// What of it lies in the map as it was in this revision.
  Trajectory In(MapId map, int64_t revision) const;

 private:
  struct Stop {
    Timestamp time;
    AnchoredPose pose;
    SE3 world_from_cam;  ///< In this map and revision of it.
    MapId map;
    int64_t revision = 0;
  };

  const double interval_s_;
  std::deque<Stop> stops_;  ///< By growing time.
};

}  // namespace deepuav
