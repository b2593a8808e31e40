#include "deepuav/tracking/tracked_pose.h"

namespace deepuav {

TrackedPose PoseIn(const LocalMap& local_map, const LocatedFrame& located) {
  const LocalKeyframe& reference = local_map.keyframes[static_cast<size_t>(located.reference)];
  return {
      local_map.map,
      {reference.id, located.cam_from_world * reference.cam_from_world.Inverse(), reference.scale},
      MatchesOf(located.seen, local_map),
      located.cam_from_world,
      local_map.revision,
      located.information,
      located.frame.motion};
}

}  // namespace deepuav
