#include "deepuav/system/watching/run_observer.h"

namespace deepuav {

KeyframeEvent EventOf(const Keyframe& keyframe, const Map& map) {
  KeyframeEvent event{keyframe.id, keyframe.frame.id,       keyframe.frame.time,
                      map.id(),    keyframe.cam_from_world, {}};
  for (const LandmarkId id : keyframe.landmarks) {
    const Landmark* landmark = id.valid() ? map.landmarks().Find(id) : nullptr;
    if (landmark && landmark->created_by == keyframe.id)
      event.new_landmarks_world.push_back(landmark->position_world);
  }
  return event;
}

}  // namespace deepuav
