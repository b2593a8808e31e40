#include "deepuav/mapping/landmarks/hovering_landmarks.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/map/all_keyframes.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

/// A flight ten units above rough ground, the camera looking down.
class HoveringLandmarksTest : public testing::Test {
 protected:
  /// `near_share` of the landmarks stand at 2 to 4 units from the camera's height.
  void Make(double near_share) {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksInBox(600, {-8, -5, 9}, {16, 5, 11}, &random);
    const auto near = static_cast<size_t>(near_share * 600);
    for (size_t i = 0; i < near; ++i) {
      // On the ray of the flight's middle, so that as many are in view.
      Eigen::Vector3d& landmark = geometry.landmarks_world[i];
      const Eigen::Vector3d middle(4, 0, 0);
      landmark = middle + random.Uniform(0.2, 0.4) * (landmark - middle);
    }
    near_ = near;
    const FeatureWorld world(geometry, 2);
    std::vector<SE3> poses;
    for (int i = 0; i < 8; ++i)
      poses.emplace_back(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-0.8 * i - 1, 0, 0));
    made_ = MakeTrueMap(world, poses, {0.3, 0.3, 0, 0}, &random);
  }
  std::set<LandmarkId> Find() const {
    return HoveringLandmarks(made_.map, AllKeyframes(made_.map), options_);
  }
  /// Of those in the map.
  std::set<LandmarkId> Near() const {
    std::set<LandmarkId> near;
    for (size_t i = 0; i < near_; ++i) {
      if (made_.landmark_of[i].valid()) near.insert(made_.landmark_of[i]);
    }
    return near;
  }

  SyntheticMap made_;
  size_t near_ = 0;
  HoveringOptions options_;
};

TEST_F(HoveringLandmarksTest, NothingHoversOverRoughGround) {
  Make(0);
  ASSERT_GT(made_.map.LandmarkCount(), 200);
  EXPECT_TRUE(Find().empty());
}

TEST_F(HoveringLandmarksTest, FindsWhatStandsFarAboveTheGround) {
  Make(0.15);
  ASSERT_GT(Near().size(), 20u);
  EXPECT_EQ(Find(), Near());
}

TEST_F(HoveringLandmarksTest, WhatMostOfAViewShowsHoldsIt) {
  Make(0.9);
  for (const LandmarkId id : Find()) EXPECT_FALSE(Near().contains(id));
}

TEST_F(HoveringLandmarksTest, WithoutAPlaneNothingIsSaid) {
  Make(0.15);
  options_.max_plane_error = 0.001;
  EXPECT_TRUE(Find().empty());
  options_ = {};
  options_.min_landmarks = 10'000;
  EXPECT_TRUE(Find().empty());
}

TEST_F(HoveringLandmarksTest, AllAreTrustedWhereAsked) {
  Make(0.15);
  options_.distrust = false;
  EXPECT_TRUE(Find().empty());
}

TEST_F(HoveringLandmarksTest, TheSameEachTime) {
  Make(0.3);
  EXPECT_EQ(Find(), Find());
}

TEST_F(HoveringLandmarksTest, OptionsOutOfRangeAreRefused) {
  options_.max_depth_share = 2;
  EXPECT_THROW(options_.Check(), Error);
}

}  // namespace
}  // namespace deepuav
