#pragma once

#include <span>
#include <utility>
#include <vector>

#include "deepuav/map/map.h"
#include "support/synthetic_features.h"

namespace deepuav {

/// A map of a FeatureWorld with its true poses and positions, and what its parts are in the world.
struct SyntheticMap {
  Map map{MapId{0}};
  IdSource ids;
  std::vector<KeyframeId> keyframes;    ///< One per pose.
  std::vector<SyntheticView> views;     ///< One per pose.
  std::vector<LandmarkId> landmark_of;  ///< Of every landmark of the world; invalid where none.
};

inline Frame FrameOf(int64_t id, const SyntheticView& view,
                     int64_t nanoseconds_a_frame = 50'000'000) {
  return {FrameId{id}, Timestamp{id * nanoseconds_a_frame}, view.features};
}

/// Maps what each of `views` shows, as if they came one after the other: keyframes with the next
/// ids at `poses`, and a landmark for all of the world that at least two of them see. Gives the
/// keyframes. `landmark_of`: one per landmark of the world, invalid where there is none.
inline std::vector<KeyframeId> MapViews(std::span<const SyntheticView> views,
                                        std::span<const SE3> poses,
                                        std::span<const Eigen::Vector3d> landmarks, Map* map,
                                        IdSource* ids, std::vector<LandmarkId>* landmark_of) {
  std::vector<int> sightings(landmarks.size(), 0);
  for (const SyntheticView& view : views) {
    for (int landmark : view.landmark) {
      if (landmark >= 0) ++sightings[static_cast<size_t>(landmark)];
    }
  }
  landmark_of->assign(landmarks.size(), {});
  for (size_t i = 0; i < landmarks.size(); ++i) {
    if (sightings[i] >= 2) (*landmark_of)[i] = ids->NextLandmark();
  }
  const KeyframeId last{ids->keyframes + static_cast<int64_t>(views.size()) - 1};
  std::vector<KeyframeId> keyframes;
  for (size_t k = 0; k < views.size(); ++k) {
    const KeyframeId id = ids->NextKeyframe();
    map->AddKeyframe(id, FrameOf(id.value, views[k]), poses[k]);
    for (size_t i = 0; i < views[k].landmark.size(); ++i) {
      if (views[k].landmark[i] < 0) continue;
      const auto shown = static_cast<size_t>(views[k].landmark[i]);
      const LandmarkId landmark = (*landmark_of)[shown];
      if (!landmark.valid()) continue;
      if (!map->Contains(landmark)) map->AddLandmark(landmark, landmarks[shown], last);
      map->AddObservation(id, static_cast<int>(i), landmark);
    }
    if (id != map->root()) map->ConnectToParent(id, KeyframeId{id.value - 1});
    keyframes.push_back(id);
  }
  for (LandmarkId id : *landmark_of) {
    if (id.valid()) map->UpdateAppearance(id);
  }
  return keyframes;
}

/// Keyframes at `poses` (frames 0, 1...), and a landmark for all that at least two of them see.
inline SyntheticMap MakeTrueMap(const FeatureWorld& world, const std::vector<SE3>& poses,
                                const FeatureNoise& noise, Random* random) {
  SyntheticMap made;
  for (const SE3& pose : poses) made.views.push_back(world.View(pose, noise, random));
  made.keyframes =
      MapViews(made.views, poses, world.landmarks(), &made.map, &made.ids, &made.landmark_of);
  return made;
}

}  // namespace deepuav
