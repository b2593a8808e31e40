#include "deepuav/mapping/keyframe_relocation.h"

#include <set>

namespace deepuav {
namespace {

void ForgetWhatItSaw(KeyframeId id, std::set<LandmarkId>* touched, Map* map) {
  const std::vector<LandmarkId> seen = map->At(id).landmarks;
  for (const LandmarkId landmark : seen) {
    if (!landmark.valid()) continue;
    map->RemoveObservation(id, landmark);
    touched->insert(landmark);
  }
}

}  // namespace

void Relocate(const std::vector<KeyframeRelocation>& relocations, Map* map) {
  std::set<LandmarkId> touched;
  for (const KeyframeRelocation& relocation : relocations)
    ForgetWhatItSaw(relocation.keyframe, &touched, map);
  for (const KeyframeRelocation& relocation : relocations) {
    map->SetFrame(relocation.keyframe, relocation.frame);
    map->SetPose(relocation.keyframe, relocation.cam_from_world);
    for (const LandmarkMatch& match : relocation.matches) {
      const auto landmark = map->Current(match.landmark);
      if (!landmark) continue;
      map->AddObservation(relocation.keyframe, match.keypoint, *landmark, match.measured);
      touched.insert(*landmark);
    }
  }
  for (const LandmarkId landmark : touched) {
    if (map->Contains(landmark)) map->UpdateAppearance(landmark);
  }
}

}  // namespace deepuav
