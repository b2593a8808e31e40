#include "deepuav/map/map_renumbering.h"

#include "deepuav/map/map_state.h"

namespace deepuav {
namespace {

/// Gives every id the place behind those that were given before.
struct IdShift {
  int64_t keyframes = 0, landmarks = 0;

  KeyframeId operator()(KeyframeId id) const {
    return id.valid() ? KeyframeId{id.value + keyframes} : id;
  }
  LandmarkId operator()(LandmarkId id) const {
    return id.valid() ? LandmarkId{id.value + landmarks} : id;
  }
  Observation operator()(const Observation& observation) const {
    return {(*this)(observation.keyframe), observation.keypoint, observation.measured};
  }
};

Keyframe Shifted(Keyframe keyframe, const IdShift& shift) {
  keyframe.id = shift(keyframe.id);
  keyframe.parent = shift(keyframe.parent);
  std::set<KeyframeId> loops;
  for (KeyframeId other : keyframe.loops) loops.insert(shift(other));
  keyframe.loops = std::move(loops);
  return keyframe;
}

Landmark Shifted(Landmark landmark, const IdShift& shift) {
  landmark.id = shift(landmark.id);
  landmark.created_by = shift(landmark.created_by);
  for (Observation& observation : landmark.observations) observation = shift(observation);
  landmark.representative = shift(landmark.representative);
  return landmark;
}

MapState ShiftedState(const Map& map, MapId id, const IdShift& shift) {
  MapState state;
  state.id = id;
  state.model_sigma_px = map.model_sigma_px();
  map.keyframes().ForEach([&](const Keyframe& k) { state.keyframes.push_back(Shifted(k, shift)); });
  map.landmarks().ForEach([&](const Landmark& l) { state.landmarks.push_back(Shifted(l, shift)); });
  for (const auto& [keyframe, culled] : map.culled()) {
    CulledKeyframe& copy = state.culled[shift(keyframe)] = culled;
    copy.pose.keyframe = shift(copy.pose.keyframe);
  }
  for (const auto& [from, into] : map.merged_into()) state.merged_into[shift(from)] = shift(into);
  return state;
}

}  // namespace

std::map<KeyframeId, KeyframeId> TakeMaps(const Atlas& other, Atlas* atlas) {
  const IdShift shift{atlas->ids().keyframes, atlas->ids().landmarks};
  std::map<KeyframeId, KeyframeId> new_ids;
  for (MapId id : other.Remaining()) {
    const Map& map = other.At(id);
    map.keyframes().ForEach([&](const Keyframe& k) { new_ids[k.id] = shift(k.id); });
    const MapId new_id = atlas->NextMap();
    atlas->Add(Map::Restore(ShiftedState(map, new_id, shift)));
    if (const Gauge gauge = other.GaugeOf(id); gauge.kind != GaugeKind::kFree)
      atlas->ChangeGauge(new_id, Sim3(), gauge);
  }
  atlas->ids().keyframes += other.ids().keyframes;
  atlas->ids().landmarks += other.ids().landmarks;
  return new_ids;
}

}  // namespace deepuav
