#include "deepuav/map/map.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/map_builder.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

constexpr int kDimension = MapBuilder::kDimension;

/// Does random things to a map, and knows what poses and landmarks must have become of them.
class RandomEditor {
 public:
  explicit RandomEditor(uint64_t seed) : builder_(seed, 40) { AddKeyframe(); }

  void Step() {
    switch (random().Index(26)) {
      case 0:
        return AddKeyframe();
      case 1:
        return RemoveKeyframe();
      case 2:
        return RemoveObservation();
      case 3:
        return RemoveLandmark();
      case 4:
      case 5:
        return Merge();
      case 6:
        return random().Index(2) ? MoveWorld() : Rescale();
      case 24:
        return builder_.map.Reroot(AnyKeyframe());
      case 25:
        return builder_.map.AddLoop(AnyKeyframe(), AnyKeyframe());
      case 7:
      case 8:
      case 9:
        return AddObservation();
      default:
        return AddLandmark();
    }
  }

  void CheckPosesAndLandmarks() const {
    for (const auto& [id, pose] : poses_) {
      ASSERT_LT(PoseDifference(map().PoseOf(id), pose), 1e-6) << id.value;
      ASSERT_TRUE(map().Contains(map().Remaining(id)));
      ASSERT_EQ(map().Contains(id), map().Remaining(id) == id);
    }
    for (const LandmarkId id : landmarks_) {
      LandmarkId end = id;
      while (merged_.contains(end)) end = merged_.at(end);
      const auto current = map().Current(id);
      ASSERT_EQ(current.has_value(), map().Contains(end));
      if (current) {
        ASSERT_EQ(*current, end);
      }
    }
  }

  const Map& map() const { return builder_.map; }

 private:
  Random& random() { return builder_.random; }

  KeyframeId AnyKeyframe() {
    std::vector<KeyframeId> all;
    map().keyframes().ForEach([&all](const Keyframe& k) { all.push_back(k.id); });
    return all[static_cast<size_t>(random().Index(static_cast<int>(all.size())))];
  }
  LandmarkId AnyLandmark() {
    std::vector<LandmarkId> all;
    map().landmarks().ForEach([&all](const Landmark& l) { all.push_back(l.id); });
    if (all.empty()) return {};
    return all[static_cast<size_t>(random().Index(static_cast<int>(all.size())))];
  }

  void AddKeyframe() {
    if (map().KeyframeCount() >= 25) return;
    const SE3 pose = RandomPose(&random());
    const KeyframeId fallback = map().KeyframeCount() > 0 ? AnyKeyframe() : KeyframeId{};
    const KeyframeId id = builder_.AddKeyframe(pose);
    poses_[id] = pose;
    if (!fallback.valid()) return;
    for (int i = 0; i < 10; ++i) {
      const LandmarkId landmark = AnyLandmark();
      if (landmark.valid()) builder_.map.AddObservation(id, random().Index(40), landmark);
    }
    builder_.map.ConnectToParent(id, fallback);
  }
  void RemoveKeyframe() {
    const KeyframeId id = AnyKeyframe();
    if (map().At(id).parent.valid()) builder_.map.RemoveKeyframe(id);
  }
  void AddLandmark() {
    const KeyframeId a = AnyKeyframe(), b = AnyKeyframe();
    const int at_a = random().Index(40), at_b = random().Index(40);
    if (a == b || map().At(a).landmarks[static_cast<size_t>(at_a)].valid() ||
        map().At(b).landmarks[static_cast<size_t>(at_b)].valid()) {
      return;
    }
    const LandmarkId id = builder_.ids.NextLandmark();
    landmarks_.push_back(id);
    builder_.map.AddLandmark(id, 5 * RandomDirection(&random()), a);
    ASSERT_TRUE(builder_.map.AddObservation(a, at_a, id));
    ASSERT_TRUE(builder_.map.AddObservation(b, at_b, id));
  }
  void AddObservation() {
    const LandmarkId id = AnyLandmark();
    if (!id.valid()) return;
    const KeyframeId keyframe = AnyKeyframe();
    const int keypoint = random().Index(40);
    const bool taken = map().At(keyframe).landmarks[static_cast<size_t>(keypoint)].valid();
    const auto& observations = map().At(id).observations;
    const bool seen = std::any_of(observations.begin(), observations.end(),
                                  [&](const Observation& o) { return o.keyframe == keyframe; });
    ASSERT_EQ(builder_.map.AddObservation(keyframe, keypoint, id), !taken && !seen);
    builder_.map.UpdateAppearance(id);
  }
  void RemoveObservation() {
    const LandmarkId id = AnyLandmark();
    if (id.valid()) builder_.map.RemoveObservation(AnyKeyframe(), id);
  }
  void RemoveLandmark() {
    const LandmarkId id = AnyLandmark();
    if (id.valid()) builder_.map.RemoveLandmark(id);
  }
  void Merge() {
    const LandmarkId from = AnyLandmark(), into = AnyLandmark();
    if (!from.valid()) return;
    builder_.map.MergeLandmark(from, into);
    if (from != into) merged_[from] = into;
  }
  void MoveWorld() {
    const SE3 new_from_old = RandomPose(&random());
    builder_.map.Transform(Sim3(new_from_old));
    for (auto& entry : poses_) entry.second = entry.second * new_from_old.Inverse();
  }
  void Rescale() {
    const double factor = random().Index(2) ? 1.25 : 0.8;
    builder_.map.Rescale(factor);
    for (auto& entry : poses_) {
      entry.second = SE3(entry.second.rotation(), factor * entry.second.translation());
    }
  }

  MapBuilder builder_;
  std::map<KeyframeId, SE3> poses_;
  std::vector<LandmarkId> landmarks_;
  std::map<LandmarkId, LandmarkId> merged_;
};

TEST(Map, StaysConsistentUnderRandomOperations) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    RandomEditor editor(seed);
    int most_keyframes = 0, most_landmarks = 0;
    for (int step = 0; step < 4000; ++step) {
      ASSERT_NO_FATAL_FAILURE(editor.Step());
      most_keyframes = std::max(most_keyframes, editor.map().KeyframeCount());
      most_landmarks = std::max(most_landmarks, editor.map().LandmarkCount());
      SCOPED_TRACE(step);
      if (step % 7 == 0) {
        ASSERT_NO_FATAL_FAILURE(CheckConsistent(editor.map()));
      }
      if (step % 50 == 0) {
        ASSERT_NO_FATAL_FAILURE(editor.CheckPosesAndLandmarks());
      }
    }
    EXPECT_GT(most_keyframes, 10);
    EXPECT_GT(most_landmarks, 40);
  }
}

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

TEST(Map, AParentIsWhoSharesMostElseTheFallback) {
  MapBuilder builder(3, 10);
  const KeyframeId a = builder.AddKeyframe(), b = builder.AddKeyframe();
  builder.map.ConnectToParent(b, a);
  EXPECT_EQ(builder.map.At(b).parent, a);
  const KeyframeId c = builder.AddKeyframe();
  builder.AddLandmark({a, c}, 0);
  builder.AddLandmark({b, c}, 1);
  builder.AddLandmark({b, c}, 2);
  builder.map.ConnectToParent(c, a);
  EXPECT_EQ(builder.map.At(c).parent, b);
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

TEST(Map, RefusesASecondLandmarkAtAKeypointAndASecondKeypointOfALandmark) {
  MapBuilder builder(5, 10);
  const KeyframeId a = builder.AddKeyframe(), b = builder.AddKeyframe();
  builder.map.ConnectToParent(b, a);
  const LandmarkId first = builder.AddLandmark({a, b}, 0);
  const LandmarkId second = builder.AddLandmark({a, b}, 1);
  EXPECT_FALSE(builder.map.AddObservation(a, 2, first));
  EXPECT_FALSE(builder.map.AddObservation(a, 1, first));
  EXPECT_EQ(builder.map.At(a).landmarks[1], second);
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

TEST(Map, CovisibleByFallingShareThenId) {
  MapBuilder builder(9, 20);
  std::vector<KeyframeId> k;
  for (int i = 0; i < 5; ++i) k.push_back(builder.AddKeyframe());
  int keypoint = 0;
  const auto share = [&](KeyframeId other, int count) {
    for (int i = 0; i < count; ++i) builder.AddLandmark({k[0], other}, keypoint++);
  };
  share(k[4], 3);
  share(k[1], 1);
  share(k[3], 5);
  share(k[2], 3);
  EXPECT_EQ(builder.map.Covisible(k[0], 1, 9), (std::vector<KeyframeId>{k[3], k[2], k[4], k[1]}));
  EXPECT_EQ(builder.map.Covisible(k[0], 3, 9), (std::vector<KeyframeId>{k[3], k[2], k[4]}));
  EXPECT_EQ(builder.map.Covisible(k[0], 1, 2), (std::vector<KeyframeId>{k[3], k[2]}));
  EXPECT_TRUE(builder.map.Covisible(k[0], 6, 9).empty());
  EXPECT_TRUE(builder.map.Covisible(k[0], 1, 0).empty());
}

TEST(Map, ViewRangeIsMeanDirectionAndExtremeDistances) {
  MapBuilder builder(10, 5);
  const KeyframeId a = builder.AddKeyframe(SE3(Eigen::Quaterniond::Identity(), {1, 0, 0}));
  const KeyframeId b = builder.AddKeyframe(SE3(Eigen::Quaterniond::Identity(), {-1, 0, 0}));
  const KeyframeId c = builder.AddKeyframe(SE3(Eigen::Quaterniond::Identity(), {0, 0, 3}));
  const LandmarkId id = builder.AddLandmark({a, b, c}, 0, {0, 0, 2});
  builder.map.UpdateViewRange(id);
  const Landmark& landmark = builder.map.At(id);
  EXPECT_NEAR(landmark.min_distance, std::sqrt(5), 1e-12);
  EXPECT_NEAR(landmark.max_distance, 5, 1e-12);
  EXPECT_LT((landmark.mean_view_direction - Eigen::Vector3d(0, 0, -1)).norm(), 1e-12);
}

TEST(Map, TheRepresentativeIsTheObservationMostLikeTheOthers) {
  Random random(11);
  const std::vector<float> common = RandomDescriptor(kDimension, &random);
  Map map{MapId{0}};
  const std::vector<double> distance_from_common = {0.5, 2, 0.02, 0.6};
  map.AddLandmark({0}, {0, 0, 5}, {0});
  for (int i = 0; i < 4; ++i) {
    Features features{{KeypointAt({10, 10})}, Descriptors(kDimension)};
    features.descriptors.Append(
        NoisyDescriptor(common, distance_from_common[static_cast<size_t>(i)], &random));
    map.AddKeyframe({i}, {FrameId{i}, {}, std::make_shared<const Features>(features)}, SE3());
    map.AddObservation({i}, 0, {0});
  }
  EXPECT_EQ(map.At(LandmarkId{0}).representative.keyframe, KeyframeId{0});
  map.UpdateAppearance({0});
  EXPECT_EQ(map.At(LandmarkId{0}).representative.keyframe, KeyframeId{2});
  map.RemoveObservation({2}, {0});
  EXPECT_NE(map.At(LandmarkId{0}).representative.keyframe, KeyframeId{2});
}

TEST(Map, RescaleMultipliesAllLengths) {
  Random random(12);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(200, {-5, -3, 4}, {5, 3, 12}, &random);
  const FeatureWorld world(geometry, 1);
  std::vector<SE3> poses;
  for (int i = 0; i < 4; ++i) poses.push_back(Perturbed(SE3(), 0.5 * i, 0.05, &random));
  SyntheticMap made = MakeTrueMap(world, poses, {}, &random);
  made.map.RemoveKeyframe(made.keyframes[1]);
  const Map before = [&] {
    SyntheticMap copy = MakeTrueMap(world, poses, {}, &random);
    copy.map.RemoveKeyframe(copy.keyframes[1]);
    return std::move(copy.map);
  }();
  made.map.Rescale(2.5);
  for (size_t k = 0; k < poses.size(); ++k) {
    const SE3 scaled(poses[k].rotation(), 2.5 * poses[k].translation());
    EXPECT_LT(PoseDifference(made.map.PoseOf(made.keyframes[k]), scaled), 1e-9) << k;
  }
  before.landmarks().ForEach([&made](const Landmark& old) {
    const Landmark& scaled = made.map.At(old.id);
    EXPECT_LT((scaled.position_world - 2.5 * old.position_world).norm(), 1e-9);
    EXPECT_NEAR(scaled.min_distance, 2.5 * old.min_distance, 1e-9);
    EXPECT_NEAR(scaled.max_distance, 2.5 * old.max_distance, 1e-9);
    EXPECT_LT((scaled.mean_view_direction - old.mean_view_direction).norm(), 1e-12);
  });
  const KeyframeId first = made.keyframes[0];
  EXPECT_NEAR(made.map.MedianDepth(first), 2.5 * before.MedianDepth(first), 1e-9);
}

TEST(Map, MovesPixelsOfKeyPointsAndMeasurementsAndOfNobodyElse) {
  MapBuilder builder(14, 10);
  const KeyframeId a = builder.AddKeyframe(), b = builder.AddKeyframe();
  const LandmarkId landmark = builder.AddLandmark({a, b}, 3);
  builder.map.SetMeasurement(b, landmark, {{11, 12}, 0.1, true});
  builder.map.UpdateAppearance(landmark);
  const std::shared_ptr<const Features> shared = builder.map.At(a).frame.features;
  const Eigen::Vector2f before = shared->keypoints[3].px, image = shared->keypoints[3].image_px;
  builder.map.MovePixels(
      [](const Eigen::Vector2f& px) -> Eigen::Vector2f { return 2 * px + Eigen::Vector2f(1, 3); });
  const Eigen::Vector2f moved = 2 * before + Eigen::Vector2f(1, 3);
  EXPECT_EQ(builder.map.At(a).features().keypoints[3].px, moved);
  EXPECT_EQ(builder.map.At(a).features().keypoints[3].image_px, image);
  const Landmark& seen = builder.map.At(landmark);
  EXPECT_EQ(seen.observations[0].measured.px, moved);
  EXPECT_EQ(seen.observations[1].measured.px, Eigen::Vector2f(23, 27));
  const auto& representative = seen.observations[seen.representative.keyframe == a ? 0 : 1];
  EXPECT_EQ(seen.representative.measured.px, representative.measured.px);
  EXPECT_EQ(shared->keypoints[3].px, before) << "others have the features, too";
}

TEST(Map, MedianDepthOfWhatAKeyframeSees) {
  MapBuilder builder(13, 10);
  const KeyframeId a = builder.AddKeyframe(SE3(Eigen::Quaterniond::Identity(), {0, 0, 1}));
  const KeyframeId b = builder.AddKeyframe();
  EXPECT_EQ(builder.map.MedianDepth(a), 0);
  int keypoint = 0;
  for (const double depth : {3.0, 100.0, 5.0})
    builder.AddLandmark({a, b}, keypoint++, {1, 2, depth});
  EXPECT_DOUBLE_EQ(builder.map.MedianDepth(a), 6);
  EXPECT_DOUBLE_EQ(builder.map.MedianDepth(b), 5);
}

}  // namespace
}  // namespace deepuav
