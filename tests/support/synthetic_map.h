#pragma once

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

/// Keyframes at `poses` (frames 0, 1...), and a landmark for all that at least two of them see.
inline SyntheticMap MakeTrueMap(const FeatureWorld& world, const std::vector<SE3>& poses,
                                const FeatureNoise& noise, Random* random) {
  SyntheticMap made;
  std::vector<std::vector<Observation>> seen(world.landmarks().size());
  for (const SE3& pose : poses) {
    const KeyframeId id = made.ids.NextKeyframe();
    made.keyframes.push_back(id);
    made.views.push_back(world.View(pose, noise, random));
    made.map.AddKeyframe(id, FrameOf(id.value, made.views.back()), pose);
    const std::vector<int>& landmarks = made.views.back().landmark;
    for (size_t i = 0; i < landmarks.size(); ++i) {
      if (landmarks[i] < 0) continue;
      seen[static_cast<size_t>(landmarks[i])].push_back({id, static_cast<int>(i)});
    }
  }
  made.landmark_of.resize(seen.size());
  for (size_t i = 0; i < seen.size(); ++i) {
    if (seen[i].size() < 2) continue;
    const LandmarkId id = made.landmark_of[i] = made.ids.NextLandmark();
    made.map.AddLandmark(id, world.landmarks()[i], made.keyframes.back());
    for (const Observation& o : seen[i]) made.map.AddObservation(o.keyframe, o.keypoint, id);
    made.map.UpdateAppearance(id);
  }
  for (size_t k = 1; k < made.keyframes.size(); ++k) {
    made.map.ConnectToParent(made.keyframes[k], made.keyframes[k - 1]);
  }
  return made;
}

}  // namespace deepuav
