#include "deepuav/mapping/correction.h"

namespace deepuav {

void MoveKeyframes(const std::vector<KeyframeMove>& moves, Map* map) {
  std::map<KeyframeId, Sim3> new_from_old;
  for (const KeyframeMove& move : moves) {
    new_from_old[move.keyframe] = move.new_from_old;
    map->Move(move.keyframe, move.new_from_old);
  }
  std::vector<LandmarkId> landmarks;
  map->landmarks().ForEach([&](const Landmark& landmark) { landmarks.push_back(landmark.id); });
  for (LandmarkId id : landmarks) {
    const Landmark& landmark = map->At(id);
    const auto move = new_from_old.find(landmark.representative.keyframe);
    if (move == new_from_old.end()) continue;
    map->SetPosition(id, move->second * landmark.position_world);
    map->SetNormal(id, move->second.rotation() * landmark.normal_world);
  }
  for (LandmarkId id : landmarks) map->UpdateViewRange(id);
}

void FuseTie(const LoopTie& tie, const PatchObserver& observer, Map* map) {
  map->AddLoop(tie.keyframe, tie.place);
  for (const LandmarkMatch& match : tie.seen) {
    const auto there = map->Current(match.landmark);
    if (!there) continue;
    const LandmarkId here = map->At(tie.keyframe).landmarks[static_cast<size_t>(match.keypoint)];
    if (here.valid()) {
      observer.Merge(map, here, *there);
    } else {
      observer.AddObservation(map, tie.keyframe, match.keypoint, *there);
    }
    map->UpdateAppearance(*there);
  }
}

void MergeMaps(const MapCorrection& correction, Atlas* atlas) {
  const LoopTie& tie = correction.ties.back();
  if (correction.into < correction.map) {
    Map& map = atlas->At(correction.map);
    map.Transform(correction.into_from_map);
    map.Reroot(tie.keyframe);
    atlas->Merge(correction.map, correction.into, tie.place);
  } else {
    Map& map = atlas->At(correction.into);
    map.Transform(correction.into_from_map.Inverse());
    map.Reroot(tie.place);
    atlas->Merge(correction.into, correction.map, tie.keyframe);
  }
}

}  // namespace deepuav
