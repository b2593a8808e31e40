#include "deepuav/tracking/tracked_pose.h"

namespace deepuav {

TrackedPose PoseIn(const LocalMap& local_map, const LocatedFrame& located) {
  const LocalKeyframe& reference = local_map.keyframes[static_cast<size_t>(located.reference)];
  TrackedPose pose{
      local_map.map,
      {reference.id, located.cam_from_world * reference.cam_from_world.Inverse(), reference.scale},
      {},
      located.cam_from_world,
      local_map.revision,
      located.information,
      located.frame.motion};
  pose.matches.reserve(located.seen.size());
  for (const LocatedFrame::Seen& seen : located.seen) {
    pose.matches.push_back(
        {seen.keypoint, local_map.landmarks[static_cast<size_t>(seen.landmark)].id, seen.measured});
  }
  return pose;
}

}  // namespace deepuav
