#include "deepuav/mapping/camera/readout_change.h"

#include <algorithm>
#include <optional>

#include "deepuav/features/readout_correction.h"
#include "deepuav/map/frame_motion.h"

namespace deepuav {
namespace {

const Observation& ObservationIn(const Landmark& landmark, KeyframeId keyframe) {
  return *std::ranges::find(landmark.observations, keyframe, &Observation::keyframe);
}

/// Where the middle row would have seen what it saw at another motion; nothing where the lens has
/// no inverse. What a detector found may not have been corrected for travel, which takes a depth.
std::optional<Eigen::Vector2d> Moved(const Observation& observation, const ReadoutMotion& before,
                                     const Keyframe& now, double depth, const Camera& camera) {
  if (observation.measured.by_patch)
    return ForOtherMotion(camera, observation.measured.px.cast<double>(), before, now.motion(),
                          1 / depth);
  const Keypoint& detected = now.features().keypoints[static_cast<size_t>(observation.keypoint)];
  return PixelInMiddleRow(detected, now.motion(), camera, 1 / depth);
}

void ChangeMotion(KeyframeId id, ReadoutMotion motion, const Camera& camera, Map* map) {
  const ReadoutMotion before = map->At(id).motion();
  motion.travel /= map->At(id).scale;
  map->SetFrame(id, WithMotion(map->At(id).frame, motion, camera));
  const Keyframe& keyframe = map->At(id);
  for (const LandmarkId landmark : keyframe.landmarks) {
    if (!landmark.valid()) continue;
    const Observation& observation = ObservationIn(map->At(landmark), id);
    const double depth = (keyframe.cam_from_world * map->At(landmark).position_world).z();
    if (!(depth > 0)) continue;
    const auto moved = Moved(observation, before, keyframe, depth, camera);
    if (!moved) continue;
    PixelMeasurement measured = observation.measured;
    measured.px = moved->cast<float>();
    map->SetMeasurement(id, landmark, measured);
  }
}

}  // namespace

void ChangeMotions(const std::map<KeyframeId, ReadoutMotion>& motions, const Camera& camera,
                   Map* map) {
  for (const auto& [id, motion] : motions) ChangeMotion(id, motion, camera, map);
}

}  // namespace deepuav
