#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "deepuav/map/map.h"
#include "support/map_builder.h"

namespace deepuav {
namespace {

TEST(Map, RemembersThePosesOfCulledKeyframesThroughGenerations) {
  MapBuilder builder(1, 5);
  std::vector<KeyframeId> ids;
  std::vector<SE3> poses;
  for (int i = 0; i < 8; ++i) {
    poses.push_back(RandomPose(&builder.random));
    ids.push_back(builder.AddKeyframe(poses.back()));
    if (i > 0) builder.map.ConnectToParent(ids.back(), ids[static_cast<size_t>(i - 1)]);
  }
  for (size_t culled : {4u, 3u, 6u, 5u, 2u}) builder.map.RemoveKeyframe(ids[culled]);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(builder.map));
  for (size_t i = 0; i < ids.size(); ++i) {
    EXPECT_LT(PoseDifference(builder.map.PoseOf(ids[i]), poses[i]), 1e-12) << i;
  }
  EXPECT_EQ(builder.map.Remaining(ids[6]), ids[1]);
  EXPECT_EQ(builder.map.Remaining(ids[7]), ids[7]);

  // They hang on the one that remains: where it goes, they go.
  const SE3 moved = RandomPose(&builder.random);
  builder.map.SetPose(ids[1], moved);
  const SE3 expected = poses[6] * poses[1].Inverse() * moved;
  EXPECT_LT(PoseDifference(builder.map.PoseOf(ids[6]), expected), 1e-12);
  EXPECT_LT(PoseDifference(builder.map.PoseOf(ids[7]), poses[7]), 1e-12);
}

TEST(Map, ChildrenOfARemovedKeyframeMoveToItsParent) {
  MapBuilder builder(2, 5);
  const KeyframeId root = builder.AddKeyframe();
  const KeyframeId middle = builder.AddKeyframe();
  builder.map.ConnectToParent(middle, root);
  const KeyframeId a = builder.AddKeyframe(), b = builder.AddKeyframe();
  builder.map.ConnectToParent(a, middle);
  builder.map.ConnectToParent(b, middle);
  builder.map.RemoveKeyframe(middle);
  EXPECT_EQ(builder.map.At(root).children, (std::set<KeyframeId>{a, b}));
  EXPECT_EQ(builder.map.At(a).parent, root);
  EXPECT_EQ(builder.map.At(b).parent, root);
  EXPECT_FALSE(builder.map.Contains(middle));
}

TEST(Map, RemovingAKeyframeTakesLandmarksThatOneOtherSaw) {
  MapBuilder builder(4, 10);
  const KeyframeId a = builder.AddKeyframe(), b = builder.AddKeyframe(), c = builder.AddKeyframe();
  builder.map.ConnectToParent(b, a);
  builder.map.ConnectToParent(c, a);
  const LandmarkId of_two = builder.AddLandmark({a, b}, 0);
  const LandmarkId of_three = builder.AddLandmark({a, b, c}, 1);
  builder.map.RemoveKeyframe(b);
  EXPECT_FALSE(builder.map.Contains(of_two));
  EXPECT_FALSE(builder.map.At(a).landmarks[0].valid());
  EXPECT_EQ(builder.map.At(of_three).observations.size(), 2u);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(builder.map));
}

TEST(Map, RemovingAnObservationThatIsNotThereChangesNothing) {
  MapBuilder builder(6, 10);
  const KeyframeId a = builder.AddKeyframe(), b = builder.AddKeyframe(), c = builder.AddKeyframe();
  builder.map.ConnectToParent(b, a);
  builder.map.ConnectToParent(c, a);
  const LandmarkId landmark = builder.AddLandmark({a, b}, 0);
  builder.map.RemoveObservation(c, landmark);
  EXPECT_EQ(builder.map.At(landmark).observations.size(), 2u);
  builder.map.RemoveObservation(b, landmark);
  EXPECT_FALSE(builder.map.Contains(landmark));
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(builder.map));
}

TEST(Map, MergingGivesObservationsAndCounts) {
  MapBuilder builder(7, 10);
  const KeyframeId a = builder.AddKeyframe(), b = builder.AddKeyframe(), c = builder.AddKeyframe();
  builder.map.ConnectToParent(b, a);
  builder.map.ConnectToParent(c, a);
  const LandmarkId kept = builder.AddLandmark({a, b}, 0), merged = builder.AddLandmark({b, c}, 1);
  builder.map.CountViews(kept, 5, 3);
  builder.map.CountViews(merged, 4, 2);
  builder.map.MergeLandmark(merged, kept);
  EXPECT_FALSE(builder.map.Contains(merged));
  const Landmark& landmark = builder.map.At(kept);
  ASSERT_EQ(landmark.observations.size(), 3u);
  EXPECT_EQ(landmark.visible, 9);
  EXPECT_EQ(landmark.found, 5);
  EXPECT_EQ(builder.map.At(c).landmarks[1], kept);
  EXPECT_FALSE(builder.map.At(b).landmarks[1].valid()) << "b sees it at key point 0 already";
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(builder.map));
}

TEST(Map, FollowsReplacementsToTheirEnd) {
  MapBuilder builder(8, 10);
  const KeyframeId a = builder.AddKeyframe(), b = builder.AddKeyframe();
  builder.map.ConnectToParent(b, a);
  std::vector<LandmarkId> ids;
  for (int i = 0; i < 5; ++i) ids.push_back(builder.AddLandmark({a, b}, i));
  builder.map.MergeLandmark(ids[0], ids[1]);
  builder.map.MergeLandmark(ids[1], ids[2]);
  builder.map.MergeLandmark(ids[3], ids[2]);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(builder.map.Current(ids[i]), ids[2]);
  builder.map.MergeLandmark(ids[4], ids[4]);
  EXPECT_EQ(builder.map.Current(ids[4]), ids[4]);
  builder.map.RemoveLandmark(ids[2]);
  for (size_t i = 0; i < 4; ++i) EXPECT_FALSE(builder.map.Current(ids[i])) << i;
  EXPECT_FALSE(builder.map.Current({99}));
}

/// A map in which keyframe 0 and its landmark stay while others come, are fused into that landmark
/// and go.
struct Churn {
  explicit Churn(uint64_t seed) : builder(seed, 5), root(builder.AddKeyframe()) {
    const KeyframeId second = builder.AddKeyframe();
    builder.map.ConnectToParent(second, root);
    kept = builder.AddLandmark({root, second}, 0);
    last = second;
  }

  void Step() {
    const KeyframeId keyframe = builder.AddKeyframe(RandomPose(&builder.random));
    builder.map.ConnectToParent(keyframe, last);
    const int free = 1 + static_cast<int>(merged.size() % 2);  // The other shows `kept`.
    const LandmarkId landmark = builder.AddLandmark({last, keyframe}, free);
    merged.push_back(landmark);
    builder.map.MergeLandmark(landmark, kept);
    culled.push_back(last);
    poses.push_back(builder.map.PoseOf(last));
    builder.map.RemoveKeyframe(last);
    last = keyframe;
  }

  MapBuilder builder;
  KeyframeId root, last;
  LandmarkId kept;
  std::vector<LandmarkId> merged;
  std::vector<KeyframeId> culled;
  std::vector<SE3> poses;
};

TEST(Map, ForgetsWhatWasRemovedButWhatIsAskedFor) {
  Churn churn(30);
  for (int i = 0; i < 40; ++i) churn.Step();
  Map& map = churn.builder.map;
  ASSERT_EQ(map.culled().size(), 40u);
  ASSERT_EQ(map.merged_into().size(), 40u);
  map.ForgetRemovedBut({churn.root, churn.culled[3], churn.culled[20], KeyframeId{999}},
                       {churn.kept, churn.merged[7], LandmarkId{999}});
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(map));
  EXPECT_EQ(map.culled().size(), 2u);
  EXPECT_EQ(map.merged_into().size(), 1u);
  for (const size_t i : {3u, 20u}) {
    EXPECT_LT(PoseDifference(map.PoseOf(churn.culled[i]), churn.poses[i]), 1e-12) << i;
    EXPECT_TRUE(map.Contains(map.culled().at(churn.culled[i]).pose.keyframe)) << i;
  }
  EXPECT_EQ(map.Current(churn.merged[7]), churn.kept);
  EXPECT_EQ(map.Current(churn.kept), churn.kept);
  EXPECT_FALSE(map.Current(churn.merged[8]));
}

TEST(Map, PosesOnRemainingKeyframesAreTheSameToTheBit) {
  Churn churn(31);
  for (int i = 0; i < 20; ++i) churn.Step();
  Map& map = churn.builder.map;
  map.Rescale(1.7);
  for (const KeyframeId id : churn.culled) {
    const AnchoredPose pose{id, RandomPose(&churn.builder.random), 0.8};
    const AnchoredPose moved = map.OnRemaining(pose);
    EXPECT_TRUE(map.Contains(moved.keyframe));
    EXPECT_EQ(map.PoseOf(pose).translation(), map.PoseOf(moved).translation());
    EXPECT_EQ(map.PoseOf(pose).rotation().coeffs(), map.PoseOf(moved).rotation().coeffs());
    EXPECT_NEAR(map.GrowthSince(pose), 1.7 / 0.8, 1e-12);
  }
  const AnchoredPose there{churn.root, RandomPose(&churn.builder.random), 0.8};
  EXPECT_EQ(map.OnRemaining(there).keyframe, churn.root);
}

TEST(Map, ReplacementsOfWhatIsGoneAreForgottenEvenWhereAskedFor) {
  Churn churn(32);
  churn.Step();
  Map& map = churn.builder.map;
  const LandmarkId merged = churn.merged.front();
  map.RemoveLandmark(churn.kept);
  EXPECT_FALSE(map.Current(merged));
  map.ForgetRemovedBut({}, {merged});
  EXPECT_TRUE(map.merged_into().empty());
  EXPECT_FALSE(map.Current(merged));
}

}  // namespace
}  // namespace deepuav
