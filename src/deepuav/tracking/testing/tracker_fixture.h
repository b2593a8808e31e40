#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/tracking/tracker.h"
#include "support/options_with.h"
#include "support/synthetic_map.h"

namespace deepuav {

/// A camera that flies past a box of landmarks, of which there is a true map.
class TrackerTest : public testing::Test {
 protected:
  static constexpr FeatureNoise kNoise{0.5, 0.3, 0, 30};

  TrackerTest() {
    std::vector<SE3> poses;
    for (int i = 0; i < 6; ++i) poses.push_back(At({0.4 * i, 0, 0}));
    made_.emplace(MakeTrueMap(world_, poses, kNoise, &random_));
    local_map_ = MakeLocalMap(made_->map, made_->keyframes[5], {});
  }

  static SE3 At(const Eigen::Vector3d& centre) {
    return SE3(Eigen::Quaterniond::Identity(), -centre);
  }
  static double CentreError(const SE3& a, const SE3& b) {
    return (a.InverseTranslation() - b.InverseTranslation()).norm();
  }

  static FeatureWorld MakeWorld() {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksInBox(800, {-10, -6, 6}, {14, 6, 20}, &random);
    return FeatureWorld(geometry, 2);
  }

  TrackingResult Track(int64_t id, const SE3& cam_from_world, bool mapping_idle = false) {
    return tracker_.Track(FrameOf(id, world_.View(cam_from_world, kNoise, &random_)), mapping_idle);
  }
  TrackingResult TrackNothing(int64_t id) {
    SyntheticView view;
    view.features = std::make_shared<const Features>(
        RandomFeatures(300, 752, 480, FeatureWorld::kDimension, &random_));
    return tracker_.Track(FrameOf(id, view), false);
  }
  SE3 PoseOf(const TrackingResult& result) const {
    return made_->map.PoseOf(result.pose->anchored);
  }

  Random random_{3};
  const FeatureWorld world_ = MakeWorld();
  std::optional<SyntheticMap> made_;
  std::shared_ptr<const LocalMap> local_map_;
  NearestNeighbourMatcher matcher_{{}};
  const TrackingOptions options_ = OptionsWith(&TrackingOptions::max_lost_frames, 5);
  Tracker tracker_{world_.camera(), options_, &matcher_, nullptr};
};

}  // namespace deepuav
