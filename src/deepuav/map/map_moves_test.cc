// How maps move: as a whole, in parts, into one another.

#include <gtest/gtest.h>

#include "support/map_builder.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

Sim3 RandomSimilarity(Random* random) { return Sim3(RandomPose(random), random->Uniform(0.5, 2)); }

/// A chain of keyframes, each the parent of the next.
std::vector<KeyframeId> AddChain(MapBuilder* builder, int length) {
  std::vector<KeyframeId> ids;
  for (int i = 0; i < length; ++i) {
    ids.push_back(builder->AddKeyframe(RandomPose(&builder->random)));
    if (i > 0) builder->map.ConnectToParent(ids[size_t(i)], ids[size_t(i) - 1]);
  }
  return ids;
}

/// Cameras seen from keyframes, and where they must be after all that happened to the map.
class FollowedCameras {
 public:
  explicit FollowedCameras(MapBuilder* builder) : builder_(*builder) {}

  void Anchor(KeyframeId id) {
    const Keyframe& keyframe = builder_.map.At(id);
    const SE3 cam_from_keyframe = RandomPose(&builder_.random);
    anchored_.push_back({id, cam_from_keyframe, keyframe.scale});
    expected_.push_back(cam_from_keyframe * keyframe.cam_from_world);
  }
  void Move(KeyframeId id, const Sim3& new_from_old) {
    for (size_t i = 0; i < anchored_.size(); ++i) {
      if (builder_.map.Remaining(anchored_[i].keyframe) == id)
        expected_[i] = new_from_old.MovePose(expected_[i]);
    }
    builder_.map.Move(id, new_from_old);
  }
  double LargestError() const {
    double largest = 0;
    for (size_t i = 0; i < anchored_.size(); ++i)
      largest = std::max(largest, PoseDifference(builder_.map.PoseOf(anchored_[i]), expected_[i]));
    return largest;
  }

 private:
  MapBuilder& builder_;
  std::vector<AnchoredPose> anchored_;
  std::vector<SE3> expected_;
};

TEST(MapMoves, CamerasMoveAndScaleWithTheKeyframesTheyHangOnThroughGenerations) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    MapBuilder builder(seed, 5);
    const std::vector<KeyframeId> ids = AddChain(&builder, 10);
    FollowedCameras cameras(&builder);
    for (KeyframeId id : ids) cameras.Anchor(id);
    for (int round = 9; round >= 1; --round) {
      for (KeyframeId id : ids) {
        if (!builder.map.Contains(id)) continue;
        cameras.Move(id, RandomSimilarity(&builder.random));
        cameras.Anchor(id);
      }
      // In any order, so that chains of culled ones come about: 5 under 4 under 3.
      builder.map.RemoveKeyframe(ids[size_t(round * 7 % 10)]);
      ASSERT_LT(cameras.LargestError(), 1e-7) << "seed " << seed << " round " << round;
    }
    EXPECT_EQ(builder.map.KeyframeCount(), 1);
  }
}

TEST(MapMoves, MovingAKeyframeLeavesTheOthersAndAllLandmarks) {
  MapBuilder builder(2, 5);
  const std::vector<KeyframeId> ids = AddChain(&builder, 3);
  const LandmarkId landmark = builder.AddLandmark(ids, 0, {1, 2, 9});
  const SE3 second = builder.map.At(ids[1]).cam_from_world;
  builder.map.Move(ids[2], RandomSimilarity(&builder.random));
  EXPECT_EQ(builder.map.At(ids[1]).cam_from_world.Matrix(), second.Matrix());
  EXPECT_EQ(builder.map.At(ids[1]).scale, 1);
  EXPECT_EQ(builder.map.At(landmark).position_world, Eigen::Vector3d(1, 2, 9));
}

SyntheticMap SmallMap(uint64_t seed) {
  Random random(seed);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(200, {-5, -3, 4}, {5, 3, 12}, &random);
  std::vector<SE3> poses;
  for (int i = 0; i < 5; ++i) poses.push_back(Perturbed(SE3(), 0.4 * i, 0.05, &random));
  return MakeTrueMap(FeatureWorld(geometry, seed), poses, {}, &random);
}

TEST(MapMoves, TransformingAMapChangesNoView) {
  SyntheticMap made = SmallMap(3);
  made.map.RemoveKeyframe(made.keyframes[2]);
  std::vector<SE3> before;
  for (KeyframeId id : made.keyframes) before.push_back(made.map.PoseOf(id));
  std::map<LandmarkId, Eigen::Vector3d> positions;
  made.map.landmarks().ForEach([&](const Landmark& l) { positions[l.id] = l.position_world; });
  const Eigen::Vector3d kNormal(0.6, 0, -0.8);
  for (const auto& entry : positions) {
    made.map.UpdateViewRange(entry.first);
    made.map.SetNormal(entry.first, kNormal);
  }
  Random random(4);
  const Sim3 new_from_old = RandomSimilarity(&random);
  made.map.Transform(new_from_old);
  for (size_t k = 0; k < before.size(); ++k) {
    const SE3 expected = new_from_old.MovePose(before[k]);
    EXPECT_LT(PoseDifference(made.map.PoseOf(made.keyframes[k]), expected), 1e-9) << k;
  }
  ASSERT_GT(positions.size(), 50u);
  for (const auto& [id, position] : positions) {
    const Landmark moved = made.map.At(id);
    EXPECT_LT((moved.position_world - new_from_old * position).norm(), 1e-9);
    for (const Observation& o : moved.observations) {
      const SE3& old_pose = before[static_cast<size_t>(o.keyframe.value)];
      const Eigen::Vector3d there = made.map.At(o.keyframe).cam_from_world * moved.position_world;
      EXPECT_LT((there - new_from_old.scale() * (old_pose * position)).norm(), 1e-9);
    }
    made.map.UpdateViewRange(id);
    const Landmark& renewed = made.map.At(id);
    EXPECT_LT((moved.mean_view_direction - renewed.mean_view_direction).norm(), 1e-9);
    EXPECT_LT((moved.normal_world - new_from_old.rotation() * kNormal).norm(), 1e-9);
    EXPECT_NEAR(moved.min_distance, renewed.min_distance, 1e-9);
    EXPECT_NEAR(moved.max_distance, renewed.max_distance, 1e-9);
  }
}

TEST(MapMoves, AnyKeyframeCanBecomeTheRoot) {
  MapBuilder builder(5, 5);
  const std::vector<KeyframeId> ids = AddChain(&builder, 5);
  const KeyframeId branch = builder.AddKeyframe();
  builder.map.ConnectToParent(branch, ids[1]);
  builder.map.Reroot(ids[3]);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(builder.map));
  EXPECT_EQ(builder.map.root(), ids[3]);
  EXPECT_EQ(builder.map.At(ids[3]).children, (std::set<KeyframeId>{ids[2], ids[4]}));
  EXPECT_EQ(builder.map.At(ids[1]).parent, ids[2]);
  EXPECT_EQ(builder.map.At(ids[0]).parent, ids[1]);
  EXPECT_EQ(builder.map.At(branch).parent, ids[1]) << "off the path nothing changes";
  builder.map.Reroot(ids[3]);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(builder.map));
  EXPECT_EQ(builder.map.root(), ids[3]);

  const SE3 first = builder.map.PoseOf(ids[0]);
  builder.map.RemoveKeyframe(ids[0]);  // The old root is one like any other.
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(builder.map));
  EXPECT_LT(PoseDifference(builder.map.PoseOf(ids[0]), first), 1e-12);
}

TEST(MapMoves, LoopsTieBothAndPassToTheParentOfARemovedKeyframe) {
  MapBuilder builder(6, 5);
  const std::vector<KeyframeId> ids = AddChain(&builder, 6);
  builder.map.AddLoop(ids[5], ids[1]);
  builder.map.AddLoop(ids[5], ids[4]);
  builder.map.AddLoop(ids[2], ids[2]);
  EXPECT_EQ(builder.map.At(ids[1]).loops, std::set<KeyframeId>{ids[5]});
  EXPECT_EQ(builder.map.At(ids[5]).loops, (std::set<KeyframeId>{ids[1], ids[4]}));
  EXPECT_TRUE(builder.map.At(ids[2]).loops.empty()) << "none with itself";
  builder.map.RemoveKeyframe(ids[5]);
  EXPECT_EQ(builder.map.At(ids[4]).loops, std::set<KeyframeId>{ids[1]})
      << "the loop with its parent has gone";
  EXPECT_EQ(builder.map.At(ids[1]).loops, std::set<KeyframeId>{ids[4]});
  builder.map.RemoveKeyframe(ids[4]);
  builder.map.RemoveKeyframe(ids[3]);
  builder.map.RemoveKeyframe(ids[2]);
  EXPECT_TRUE(builder.map.At(ids[1]).loops.empty());
}

/// Two maps whose ids come from one source, the second known in another world and scale.
class AbsorbTest : public testing::Test {
 protected:
  AbsorbTest() : builder_(7, 12) {
    into_ = AddChain(&builder_, 4);
    Fill(into_);
    first_ = std::move(builder_.map);
    builder_.map = Map(MapId{1});
    other_ = AddChain(&builder_, 5);
    Fill(other_);
    builder_.map.AddLoop(other_[4], other_[0]);
    merged_ = builder_.AddLandmark(other_, 10);
    builder_.map.MergeLandmark(merged_, landmark_);
    builder_.map.RemoveKeyframe(other_[2]);
  }
  void Fill(const std::vector<KeyframeId>& ids) {
    for (int i = 0; i < 6; ++i) landmark_ = builder_.AddLandmark(ids, i);
  }

  MapBuilder builder_;
  Map first_{MapId{0}};
  std::vector<KeyframeId> into_, other_;
  LandmarkId landmark_, merged_;
};

TEST_F(AbsorbTest, TakesAllThatTheOtherHolds) {
  Map& other = builder_.map;
  std::vector<SE3> poses;
  for (KeyframeId id : other_) poses.push_back(other.PoseOf(id));
  const int keyframes = first_.KeyframeCount() + other.KeyframeCount();
  const int landmarks = first_.LandmarkCount() + other.LandmarkCount();
  other.Reroot(other_[3]);
  first_.Absorb(&other, into_[2]);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(first_));
  EXPECT_EQ(first_.id(), MapId{0});
  EXPECT_EQ(first_.root(), into_[0]);
  EXPECT_EQ(first_.KeyframeCount(), keyframes);
  EXPECT_EQ(first_.LandmarkCount(), landmarks);
  EXPECT_EQ(first_.At(other_[3]).parent, into_[2]);
  for (size_t k = 0; k < other_.size(); ++k)
    EXPECT_LT(PoseDifference(first_.PoseOf(other_[k]), poses[k]), 1e-12) << k;
  EXPECT_FALSE(first_.Contains(other_[2]));
  EXPECT_EQ(first_.Current(merged_), landmark_);
  EXPECT_EQ(first_.At(other_[4]).loops, std::set<KeyframeId>{other_[0]});

  EXPECT_EQ(other.KeyframeCount(), 0);
  EXPECT_EQ(other.LandmarkCount(), 0);
  EXPECT_FALSE(other.root().valid());
  EXPECT_TRUE(other.culled().empty());
  EXPECT_TRUE(other.merged_into().empty());
}

}  // namespace
}  // namespace deepuav
