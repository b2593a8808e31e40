#include "deepuav/system/frames/frame_path.h"

#include <map>
#include <set>

#include "deepuav/map/landmark_noise.h"

namespace deepuav {

Trajectory PathIn(const Atlas& atlas, MapId map, const std::vector<FrameRecord>& records,
                  const PoseOfFrame& pose_of_frame) {
  const Map& in = atlas.At(map);
  std::map<FrameId, const Keyframe*> keyframes;
  in.keyframes().ForEach(
      [&](const Keyframe& keyframe) { keyframes.emplace(keyframe.frame.id, &keyframe); });
  Trajectory path;
  for (const FrameRecord& record : records) {
    if (!record.located() || atlas.Current(record.map) != in.id()) continue;
    const auto keyframe = keyframes.find(record.id);
    const bool is_keyframe =
        keyframe != keyframes.end() && keyframe->second->frame.time == record.time;
    const SE3 cam_from_world = is_keyframe     ? keyframe->second->cam_from_world
                               : pose_of_frame ? pose_of_frame(record)
                                               : in.PoseOf(record.pose);
    path.push_back({record.time, cam_from_world.Inverse()});
  }
  return path;
}

void PlaceInMaps(const Atlas& atlas, std::vector<FrameRecord>* records) {
  for (FrameRecord& record : *records) {
    if (!record.located()) continue;
    record.map = atlas.Current(record.map);
    record.cam_from_world = atlas.At(record.map).PoseOf(record.pose);
  }
}

std::vector<PoseObservation> ObservationsOf(const Map& map, const FrameRecord& record,
                                            const SE3& cam_from_world) {
  std::vector<PoseObservation> observations;
  std::set<LandmarkId> used;  // two landmarks seen may have become one since
  for (const FrameRecord::Seen& seen : record.seen) {
    const auto landmark = map.Current(seen.landmark);
    if (!landmark || !used.insert(*landmark).second) continue;
    const Landmark& seen_landmark = map.At(*landmark);
    const PixelNoise noise = seen.measured.NoiseWith(map.model_sigma_px()) +
                             ExpectedPixelNoise(PositionNoise(map, seen_landmark),
                                                seen_landmark.position_world, cam_from_world);
    observations.push_back({seen_landmark.position_world, seen.measured.px.cast<double>(), noise});
  }
  return observations;
}

}  // namespace deepuav
