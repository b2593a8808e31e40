#include "deepuav/system/sensors/moving_path.h"

namespace deepuav {

void MovingPath::Add(const FrameRecord& record) {
  if (!stops_.empty() && SecondsBetween(stops_.back().time, record.time) < interval_s_) return;
  stops_.push_back(
      {record.time, record.pose, record.cam_from_world.Inverse(), record.map, record.map_revision});
}

void MovingPath::Follow(const Map& map) {
  for (Stop& stop : stops_) {
    const KeyframeId anchor = stop.pose.keyframe;
    if (!map.Contains(anchor) && !map.culled().contains(anchor)) continue;  // Of another map.
    stop.pose = map.OnRemaining(stop.pose);  // The map may forget those that were removed.
    stop.world_from_cam = map.PoseOf(stop.pose).Inverse();
    stop.map = map.id();
    stop.revision = map.revision();
  }
}

void MovingPath::ForgetBefore(Timestamp time) {
  while (!stops_.empty() && stops_.front().time < time) stops_.pop_front();
}

Trajectory MovingPath::In(MapId map, int64_t revision) const {
  Trajectory path;
  for (const Stop& stop : stops_) {
    if (stop.map == map && stop.revision == revision)
      path.push_back({stop.time, stop.world_from_cam});
  }
  return path;
}

}  // namespace deepuav
