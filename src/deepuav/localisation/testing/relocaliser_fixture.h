#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/localisation/relocaliser.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "support/synthetic_map.h"

namespace deepuav {

using LocalMaps = std::vector<std::shared_ptr<const LocalMap>>;

inline constexpr double kHeight = 12;

/// A camera that looks straight down at the ground.
inline SE3 Above(double x, double y, double heading_deg) {
  return LookDown({x, y, kHeight}, heading_deg * std::numbers::pi / 180);
}

/// Ground that is 40 long and 20 wide, of landmarks with random descriptors.
inline SyntheticWorld Ground(uint64_t seed) {
  Random random(seed);
  SyntheticWorld world;
  world.landmarks_world = LandmarksOnGround(2500, {-10, -10}, {30, 10}, 1, &random);
  return world;
}

/// A map of a straight flight along x, heading along x.
class RelocaliserTest : public testing::Test {
 protected:
  RelocaliserTest() {
    std::vector<SE3> poses;
    for (int i = 0; i < 8; ++i) poses.push_back(Above(2.5 * i, 0, 0));
    made_.emplace(MakeTrueMap(world_, poses, {0.5, 0.3, 0, 30}, &random_));
    for (KeyframeId id : made_->keyframes) around_.push_back(MakeLocalMap(made_->map, id, {}));
  }

  std::optional<Relocaliser::Found> Relocalise(const SyntheticView& view,
                                               const LocalMaps& candidates,
                                               const std::vector<Descriptors>& turned = {}) {
    return relocaliser_.Relocalise(FrameOf(100, view), turned, candidates, &reason_);
  }

  static void ExpectPose(const SE3& found, const SE3& truth) {
    EXPECT_LT((found.InverseTranslation() - truth.InverseTranslation()).norm(), 0.05);
    EXPECT_LT((found * truth.Inverse()).Angle(), 0.004);
  }

  const FeatureWorld world_{Ground(1), 2};
  Random random_{3};
  std::optional<SyntheticMap> made_;
  LocalMaps around_;  ///< Of each keyframe.
  NearestNeighbourMatcher matcher_{{}};
  Relocaliser relocaliser_{world_.camera(), {}, {}, {&matcher_}, nullptr};
  std::string reason_;
};

/// Two stretches of a map that look the same, far apart: the second shows the first's landmarks at
/// other places.
inline SyntheticMap MapOfTwoAlike(const FeatureWorld& world, Random* random) {
  constexpr double kApart = 1000;
  constexpr int kKeyframesEach = 4;
  SyntheticMap made;
  for (const double offset : {0.0, kApart}) {
    std::vector<std::vector<Observation>> seen(world.landmarks().size());
    for (int i = 0; i < kKeyframesEach; ++i) {
      const KeyframeId id = made.ids.NextKeyframe();
      made.keyframes.push_back(id);
      made.views.push_back(world.View(Above(2.5 * i, 0, 0), {0.5, 0.3, 0, 30}, random));
      made.map.AddKeyframe(id, FrameOf(id.value, made.views.back()), Above(2.5 * i + offset, 0, 0));
      const std::vector<int>& landmarks = made.views.back().landmark;
      for (size_t k = 0; k < landmarks.size(); ++k) {
        if (landmarks[k] < 0) continue;
        seen[static_cast<size_t>(landmarks[k])].push_back({id, static_cast<int>(k)});
      }
    }
    for (size_t i = 0; i < seen.size(); ++i) {
      if (seen[i].size() < 2) continue;
      const LandmarkId id = made.ids.NextLandmark();
      made.map.AddLandmark(id, world.landmarks()[i] + Eigen::Vector3d(offset, 0, 0),
                           made.keyframes.back());
      for (const Observation& o : seen[i]) made.map.AddObservation(o.keyframe, o.keypoint, id);
      made.map.UpdateAppearance(id);
    }
  }
  return made;
}

}  // namespace deepuav
