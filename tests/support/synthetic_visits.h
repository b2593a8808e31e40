#pragma once

#include <span>
#include <vector>

#include "deepuav/geometry/sim3.h"
#include "deepuav/map/atlas.h"
#include "deepuav/map/map_correction.h"
#include "support/synthetic_map.h"

namespace deepuav {

/// What one passage past a place left in a map.
struct Visit {
  MapId map;
  std::vector<KeyframeId> keyframes;    ///< One per pose.
  std::vector<LandmarkId> landmark_of;  ///< Of every landmark of the world; invalid where none.
};

/// An atlas of passages through a FeatureWorld, each mapped on its own: landmarks that two visits
/// see are in the map twice, and each visit lies where its drift put it.
class SyntheticVisits {
 public:
  SyntheticVisits(const FeatureWorld& world, uint64_t seed) : random(seed), world_(world) {}

  MapId AddMap() { return atlas.Add(Map(atlas.NextMap())).id(); }

  /// Keyframes at the true `poses`, as MapViews maps them in a world that `map_from_world` leads
  /// to. Hangs on the keyframe before where the map has one already.
  Visit Add(MapId map_id, const std::vector<SE3>& poses, const Sim3& map_from_world = {},
            const FeatureNoise& noise = {0.5, 0.3, 0, 20}) {
    Visit visit{map_id, {}, {}};
    const size_t before = views.size();
    std::vector<SE3> mapped_poses;
    std::vector<Eigen::Vector3d> mapped_landmarks;
    for (const SE3& pose : poses) {
      truth.push_back(pose);
      views.push_back(world_.View(pose, noise, &random));
      mapped_poses.push_back(map_from_world.MovePose(pose));
    }
    for (const Eigen::Vector3d& position : world_.landmarks())
      mapped_landmarks.push_back(map_from_world * position);
    visit.keyframes = MapViews(std::span(views).subspan(before), mapped_poses, mapped_landmarks,
                               &atlas.At(map_id), &atlas.ids(), &visit.landmark_of);
    return visit;
  }

  /// A keyframe of one visit that sees the landmarks of another.
  LoopTie Tie(KeyframeId keyframe, const Visit& place, KeyframeId place_keyframe) const {
    LoopTie tie{keyframe, place_keyframe, {}};
    const std::vector<int>& shown = views[static_cast<size_t>(keyframe.value)].landmark;
    for (size_t i = 0; i < shown.size(); ++i) {
      if (shown[i] < 0) continue;
      const LandmarkId there = place.landmark_of[static_cast<size_t>(shown[i])];
      if (there.valid()) tie.seen.push_back({static_cast<int>(i), there});
    }
    return tie;
  }

  Random random;
  Atlas atlas;
  std::vector<SE3> truth;            ///< cam_from_world, by keyframe id.
  std::vector<SyntheticView> views;  ///< By keyframe id.

 private:
  const FeatureWorld& world_;
};

/// Ground of 50 x 20, and cameras that fly along it, looking down from 12.
inline FeatureWorld StripOfGround(uint64_t seed, int landmarks = 1500) {
  Random random(seed);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksOnGround(landmarks, {-12, -10}, {38, 10}, 1, &random);
  return FeatureWorld(geometry, seed + 1);
}
inline std::vector<SE3> FlightAlongStrip(double from_x, int count, double y = 0,
                                         double spacing = 2) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i) poses.push_back(LookDown({from_x + spacing * i, y, 12}, 0));
  return poses;
}

}  // namespace deepuav
