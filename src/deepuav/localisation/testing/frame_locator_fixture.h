#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "deepuav/localisation/frame_locator.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "support/synthetic_map.h"

namespace deepuav {

inline SE3 At(const Eigen::Vector3d& centre) {
  return SE3(Eigen::Quaterniond::Identity(), -centre);
}

/// Counts how often the reference was matched.
class CountingMatcher : public Matcher {
 public:
  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override {
    ++calls;
    return matcher_.MatchFeatures(a, b);
  }
  std::string Description() const override { return "counting"; }
  int calls = 0;

 private:
  NearestNeighbourMatcher matcher_{{}};
};

/// A map of six keyframes that move sideways past a box of landmarks.
class FrameLocatorTest : public testing::Test {
 protected:
  FrameLocatorTest() {
    std::vector<SE3> poses;
    for (int i = 0; i < 6; ++i) poses.push_back(At({0.5 * i, 0, 0}));
    made_.emplace(MakeTrueMap(world_, poses, {0.5, 0.3, 0, 30}, &random_));
    local_map_ = MakeLocalMap(made_->map, made_->keyframes[5], {});
  }

  static FeatureWorld MakeWorld() {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksInBox(700, {-8, -5, 6}, {10, 5, 20}, &random);
    return FeatureWorld(geometry, 2);
  }

  LocationPrior PriorAt(const SE3& cam_from_world) const {
    LocationPrior prior;
    prior.cam_from_world = cam_from_world;
    prior.reference = made_->keyframes[5];
    for (LandmarkId id : made_->map.At(made_->keyframes[5]).landmarks) {
      if (id.valid()) prior.landmarks.push_back(id);
    }
    return prior;
  }

  std::optional<LocatedFrame> Locate(const SyntheticView& view, const LocationPrior& prior) {
    return locator_.Locate(FrameOf(20, view), *local_map_, prior, &reason_);
  }

  /// The first key points that show landmarks of the map, as many as given, and no others.
  SyntheticView ShowingOnly(int count, const SyntheticView& full) const {
    Features some{{}, Descriptors(FeatureWorld::kDimension)};
    SyntheticView view;
    for (int i = 0; i < full.features->size() && some.size() < count; ++i) {
      const int landmark = full.landmark[static_cast<size_t>(i)];
      if (landmark < 0 || !made_->landmark_of[static_cast<size_t>(landmark)].valid()) continue;
      some.keypoints.push_back(full.features->keypoints[static_cast<size_t>(i)]);
      some.descriptors.AppendFrom(full.features->descriptors, i);
      view.landmark.push_back(landmark);
    }
    EXPECT_EQ(some.size(), count);
    view.features = std::make_shared<const Features>(std::move(some));
    return view;
  }

  void ExpectRight(const LocatedFrame& located, const SyntheticView& view, double max_wrong_ratio) {
    EXPECT_LT((located.cam_from_world.InverseTranslation() - truth_.InverseTranslation()).norm(),
              0.02);
    EXPECT_LT((located.cam_from_world * truth_.Inverse()).Angle(), 0.002);
    int wrong = 0, before = -1;
    for (const LocatedFrame::Seen& seen : located.seen) {
      EXPECT_LT(before, seen.keypoint) << "one each, by key point";
      before = seen.keypoint;
      const int shown = view.landmark[static_cast<size_t>(seen.keypoint)];
      const LandmarkId id = local_map_->landmarks[static_cast<size_t>(seen.landmark)].id;
      wrong += shown < 0 || made_->landmark_of[static_cast<size_t>(shown)] != id;
    }
    EXPECT_LE(wrong, max_wrong_ratio * static_cast<double>(located.seen.size()));
  }

  Random random_{3};
  const FeatureWorld world_ = MakeWorld();
  const SE3 truth_ = At({2.8, 0.05, 0.1});
  std::optional<SyntheticMap> made_;
  std::shared_ptr<const LocalMap> local_map_;
  CountingMatcher matcher_;
  FrameLocator locator_{world_.camera(), {}, &matcher_, nullptr};
  std::string reason_;
};

}  // namespace deepuav
