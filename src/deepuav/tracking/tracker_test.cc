#include "deepuav/tracking/tracker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "deepuav/base/error.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "support/options_with.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

constexpr FeatureNoise kNoise{0.5, 0.3, 0, 30};

SE3 At(const Eigen::Vector3d& centre) { return SE3(Eigen::Quaterniond::Identity(), -centre); }

double CentreError(const SE3& a, const SE3& b) {
  return (a.InverseTranslation() - b.InverseTranslation()).norm();
}

/// A camera that flies past a box of landmarks, of which there is a true map.
class TrackerTest : public testing::Test {
 protected:
  TrackerTest() {
    std::vector<SE3> poses;
    for (int i = 0; i < 6; ++i) poses.push_back(At({0.4 * i, 0, 0}));
    made_.emplace(MakeTrueMap(world_, poses, kNoise, &random_));
    local_map_ = MakeLocalMap(made_->map, made_->keyframes[5], {});
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

TEST_F(TrackerTest, AsksForAMapThenTracksInIt) {
  std::optional<InitialMapRequest> request;
  int64_t id = 0;
  for (; id < 40 && !request; ++id) {
    const TrackingResult result = Track(id, At({0.1 * static_cast<double>(id), 0, 0}));
    EXPECT_EQ(result.state, TrackingState::kInitialising);
    EXPECT_FALSE(result.pose);
    EXPECT_FALSE(result.keyframe);
    request = result.initial_map;
    if (!request) {
      EXPECT_THAT(result.reason, testing::StartsWith("waiting for "));
    }
  }
  ASSERT_TRUE(request);
  EXPECT_LT(request->first.id, request->second.id);
  EXPECT_LT(request->second.id.value, id - 1) << "a third view confirms";
  tracker_.Begin(local_map_);
  const TrackingResult result = Track(id, At({2.1, 0, 0}));
  EXPECT_EQ(result.state, TrackingState::kTracking);
  ASSERT_TRUE(result.pose);
  EXPECT_TRUE(result.reason.empty());
  EXPECT_LT(CentreError(PoseOf(result), At({2.1, 0, 0})), 0.02);
}

TEST_F(TrackerTest, TracksAlongThePath) {
  tracker_.Begin(local_map_);
  for (int64_t i = 0; i < 30; ++i) {
    const SE3 truth = At({1.5 + 0.05 * static_cast<double>(i), 0, 0});
    const TrackingResult result = Track(i, truth);
    ASSERT_TRUE(result.pose) << i << ": " << result.reason;
    EXPECT_EQ(result.pose->map, made_->map.id());
    EXPECT_LT(CentreError(PoseOf(result), truth), 0.02);
    EXPECT_GT(result.pose->matches.size(), 100u);
    for (const LandmarkMatch& match : result.pose->matches) {
      EXPECT_TRUE(made_->map.Contains(match.landmark));
    }
  }
}

TEST_F(TrackerTest, AsksForKeyframesOnlyWhenMappingIsIdle) {
  tracker_.Begin(local_map_);
  const SE3 away = At({4.5, 0, 0});
  EXPECT_FALSE(Track(0, At({2, 0, 0}), false).keyframe);
  EXPECT_FALSE(Track(1, away, false).keyframe);
  const TrackingResult result = Track(2, away, true);
  ASSERT_TRUE(result.keyframe) << result.reason;
  EXPECT_EQ(result.keyframe->map, made_->map.id());
  EXPECT_EQ(result.keyframe->frame.id, FrameId{2});
  EXPECT_EQ(result.keyframe->pose.keyframe, result.pose->anchored.keyframe);
  EXPECT_EQ(result.keyframe->matches.size(), result.pose->matches.size());
}

TEST_F(TrackerTest, CountsHowOftenLandmarksWereVisibleAndFound) {
  tracker_.Begin(local_map_);
  std::map<LandmarkId, int> found;
  std::optional<KeyframeRequest> request;
  for (int64_t i = 0; i < 5; ++i) {
    const TrackingResult result = Track(i, At({4.5, 0, 0}), i == 4);
    ASSERT_TRUE(result.pose);
    for (const LandmarkMatch& match : result.pose->matches) ++found[match.landmark];
    request = result.keyframe;
  }
  ASSERT_TRUE(request);
  std::set<LandmarkId> counted;
  for (const ViewCount& view : request->views) {
    EXPECT_TRUE(counted.insert(view.landmark).second);
    EXPECT_EQ(view.found, found[view.landmark]);
    EXPECT_GE(view.visible, view.found);
    EXPECT_LE(view.visible, 5);
  }
  EXPECT_GE(counted.size(), found.size());
  // Each view is reported once.
  const TrackingResult next = Track(5, At({4.5, 0, 0}), true);
  ASSERT_TRUE(next.keyframe);
  for (const ViewCount& view : next.keyframe->views) EXPECT_LE(view.visible, 1);
}

TEST_F(TrackerTest, SaysWhyItIsLostAndFindsBack) {
  tracker_.Begin(local_map_);
  ASSERT_TRUE(Track(0, At({1.9, 0, 0})).pose);
  ASSERT_TRUE(Track(1, At({2.0, 0, 0})).pose);
  for (int64_t i = 2; i < 6; ++i) {
    const TrackingResult result = TrackNothing(i);
    EXPECT_EQ(result.state, TrackingState::kLost);
    EXPECT_FALSE(result.pose);
    EXPECT_EQ(result.reason, "no pose from 300 key points");
  }
  const SE3 elsewhere = SE3(RotationExp({0, 0.1, 0.3}), Eigen::Vector3d(-1, 0.2, 0));
  const TrackingResult result = Track(6, elsewhere);
  EXPECT_EQ(result.state, TrackingState::kTracking);
  ASSERT_TRUE(result.pose) << result.reason;
  EXPECT_LT(CentreError(PoseOf(result), elsewhere), 0.03);
}

TEST_F(TrackerTest, StartsANewMapWhenLostForTooLong) {
  tracker_.Begin(local_map_);
  ASSERT_TRUE(Track(0, At({2, 0, 0})).pose);
  for (int64_t i = 1; i <= options_.max_lost_frames; ++i) {
    EXPECT_EQ(TrackNothing(i).state, TrackingState::kLost) << i;
  }
  const TrackingResult last = TrackNothing(6);
  EXPECT_EQ(last.state, TrackingState::kInitialising);
  EXPECT_EQ(last.reason, "no pose from 300 key points; starting a new map");
  std::optional<InitialMapRequest> request;
  int64_t id = 7;
  for (; id < 47 && !request; ++id) {
    const TrackingResult result = Track(id, At({0.1 * static_cast<double>(id), 0, 0}));
    EXPECT_FALSE(result.pose);
    request = result.initial_map;
  }
  ASSERT_TRUE(request);
  EXPECT_GE(request->first.id.value, 7);
  tracker_.Begin(local_map_);
  EXPECT_TRUE(Track(id, At({2, 0, 0})).pose);
  // The count of lost frames begins anew.
  for (int64_t i = 1; i <= options_.max_lost_frames; ++i) {
    EXPECT_EQ(TrackNothing(id + i).state, TrackingState::kLost) << i;
  }
}

TEST_F(TrackerTest, PhotographsASecondApartMayBeMissedOnce) {
  const auto at_second = [this](int64_t id, SyntheticView view) {
    Frame frame = FrameOf(id, view);
    frame.time = Timestamp{id * 1'000'000'000};
    return tracker_.Track(frame, false);
  };
  const auto nothing = [this] {
    SyntheticView view;
    view.features = std::make_shared<const Features>(
        RandomFeatures(300, 752, 480, FeatureWorld::kDimension, &random_));
    return view;
  };
  tracker_.Begin(local_map_);
  ASSERT_TRUE(at_second(1, world_.View(At({1.8, 0, 0}), kNoise, &random_)).pose);
  EXPECT_EQ(at_second(2, nothing()).state, TrackingState::kLost);
  EXPECT_TRUE(at_second(3, world_.View(At({2, 0, 0}), kNoise, &random_)).pose);
  EXPECT_EQ(at_second(4, nothing()).state, TrackingState::kLost);
  EXPECT_EQ(at_second(5, nothing()).state, TrackingState::kInitialising);
}

TEST_F(TrackerTest, StartsNoMapWhereItMayNot) {
  TrackingOptions options = options_;
  options.starts_maps = false;
  Tracker tracker(world_.camera(), options, &matcher_, nullptr);
  for (int64_t id = 0; id < 40; ++id) {
    const SE3 pose = At({0.1 * static_cast<double>(id), 0, 0});
    const TrackingResult result =
        tracker.Track(FrameOf(id, world_.View(pose, kNoise, &random_)), true);
    EXPECT_FALSE(result.initial_map);
    EXPECT_EQ(result.reason, "not found in a map");
  }
}

TEST_F(TrackerTest, FramesInBetweenEndTheCountOfLostFrames) {
  tracker_.Begin(local_map_);
  int64_t id = 0;
  for (int round = 0; round < 3; ++round) {
    EXPECT_TRUE(Track(id++, At({2, 0, 0})).pose);
    for (int i = 0; i < options_.max_lost_frames; ++i) {
      EXPECT_EQ(TrackNothing(id++).state, TrackingState::kLost);
    }
  }
}

TEST_F(TrackerTest, FollowsASuddenJump) {
  tracker_.Begin(local_map_);
  for (int64_t i = 0; i < 5; ++i) {
    ASSERT_TRUE(Track(i, At({0.05 * static_cast<double>(i), 0, 0})).pose);
  }
  const SE3 jumped = SE3(RotationExp({0.1, -0.25, 0.2}), Eigen::Vector3d(-1.5, 0.3, 0.5));
  const TrackingResult result = Track(5, jumped);
  ASSERT_TRUE(result.pose) << result.reason;
  EXPECT_LT(CentreError(PoseOf(result), jumped), 0.03);
}

TEST_F(TrackerTest, GoesOnAfterAGapOfTenFrames) {
  tracker_.Begin(local_map_);
  const auto truth = [](int64_t i) {
    return SE3(RotationExp({0, 0.01 * static_cast<double>(i), 0}),
               Eigen::Vector3d(-0.06 * static_cast<double>(i), 0, 0));
  };
  for (int64_t i = 0; i < 5; ++i) ASSERT_TRUE(Track(i, truth(i)).pose);
  for (int64_t i : {15, 16, 17}) {
    const TrackingResult result = Track(i, truth(i));
    ASSERT_TRUE(result.pose) << result.reason;
    EXPECT_LT(CentreError(PoseOf(result), truth(i)), 0.03);
  }
}

TEST_F(TrackerTest, MovesWithTheMap) {
  tracker_.Begin(local_map_);
  ASSERT_TRUE(Track(0, At({1.9, 0, 0})).pose);
  ASSERT_TRUE(Track(1, At({2.0, 0, 0})).pose);
  const SE3 old_from_new = SE3(RotationExp({0.1, 0.4, -0.2}), {30, -20, 10});
  Map& map = made_->map;
  std::vector<LandmarkId> landmarks;
  map.landmarks().ForEach([&](const Landmark& l) { landmarks.push_back(l.id); });
  for (KeyframeId id : made_->keyframes) map.SetPose(id, map.At(id).cam_from_world * old_from_new);
  for (LandmarkId id : landmarks) {
    map.SetPosition(id, old_from_new.Inverse() * map.At(id).position_world);
    map.UpdateViewRange(id);
  }
  tracker_.UseLocalMap(MakeLocalMap(map, made_->keyframes[5], {}));
  const SE3 truth = At({2.1, 0, 0}) * old_from_new;
  const TrackingResult result = Track(2, At({2.1, 0, 0}));
  ASSERT_TRUE(result.pose) << result.reason;
  EXPECT_LT(CentreError(PoseOf(result), truth), 0.02);
}

TEST_F(TrackerTest, FollowsItsKeyframeIntoAnotherMap) {
  tracker_.Begin(local_map_);
  ASSERT_TRUE(Track(1, At({2, 0, 0})).pose);
  auto merged = std::make_shared<LocalMap>(*local_map_);
  merged->map = MapId{7};
  tracker_.UseLocalMap(merged);
  const TrackingResult result = Track(2, At({2, 0, 0}));
  ASSERT_TRUE(result.pose);
  EXPECT_EQ(result.pose->map, merged->map);
}

TEST_F(TrackerTest, ScalesItsMotionWithTheMap) {
  const double growth = 3;
  tracker_.Begin(local_map_);
  for (int64_t i = 1; i <= 3; ++i) ASSERT_TRUE(Track(i, At({0.2 * double(i), 0, 0})).pose);
  auto grown = std::make_shared<LocalMap>(*local_map_);
  const auto scaled = [growth](const SE3& pose) {
    return SE3(pose.rotation(), growth * pose.translation());
  };
  for (LocalKeyframe& keyframe : grown->keyframes) {
    keyframe.cam_from_world = scaled(keyframe.cam_from_world);
    keyframe.scale = growth;
  }
  for (LocalLandmark& landmark : grown->landmarks) {
    landmark.position_world *= growth;
    landmark.min_distance *= growth;
    landmark.max_distance *= growth;
  }
  tracker_.UseLocalMap(grown);
  const TrackingResult result = Track(4, At({0.8, 0, 0}));
  ASSERT_TRUE(result.pose);
  const AnchoredPose& pose = result.pose->anchored;
  EXPECT_EQ(pose.keyframe_scale, growth);
  const SE3 expected = scaled(At({0.8, 0, 0}));
  const SE3 found = pose.cam_from_keyframe * scaled(made_->map.At(pose.keyframe).cam_from_world);
  EXPECT_LT((found.InverseTranslation() - expected.InverseTranslation()).norm(), 0.1);
}

TEST_F(TrackerTest, ResumesWhereAFrameWasFoundAndAsksForAKeyframe) {
  LocatedFrame located;
  located.cam_from_world = At({2, 0, 0});
  for (int i = 0; i < 60; ++i) located.seen.push_back({i, i});
  const Frame frame = FrameOf(5, world_.View(At({2, 0, 0}), kNoise, &random_));
  const TrackingResult result = tracker_.Resume(frame, local_map_, located);
  EXPECT_EQ(result.state, TrackingState::kTracking);
  ASSERT_TRUE(result.pose && result.keyframe);
  EXPECT_EQ(result.keyframe->matches.size(), 60u);
  EXPECT_TRUE(Track(6, At({2, 0, 0})).pose);
}

TEST_F(TrackerTest, TakesNoLocalMapBeforeItBegins) {
  tracker_.UseLocalMap(local_map_);
  EXPECT_EQ(Track(0, At({0, 0, 0})).state, TrackingState::kInitialising);
}

TEST_F(TrackerTest, GoesOnInAnotherMapThatLostItsKeyframe) {
  tracker_.Begin(local_map_);
  ASSERT_TRUE(Track(1, At({2, 0, 0})).pose);
  ASSERT_TRUE(Track(2, At({2.1, 0, 0})).pose);
  const SE3 moved = SE3::Exp((Vector6d() << 30, -20, 5, 0.4, 1, -2).finished());
  auto other = std::make_shared<LocalMap>(*local_map_);
  other->map = MapId{7};
  for (LocalKeyframe& keyframe : other->keyframes) {
    keyframe.id.value += 1000;
    keyframe.cam_from_world = keyframe.cam_from_world * moved.Inverse();
  }
  for (LocalLandmark& landmark : other->landmarks) {
    landmark.position_world = moved * landmark.position_world;
    landmark.mean_view_direction = moved.rotation() * landmark.mean_view_direction;
  }
  tracker_.UseLocalMap(other);
  const TrackingResult result = Track(3, At({2.2, 0, 0}));
  ASSERT_TRUE(result.pose);
  EXPECT_EQ(result.pose->map, MapId{7});
}

TEST(TrackingOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(TrackingOptions().Check());
  EXPECT_THROW(OptionsWith(&TrackingOptions::max_lost_frames, -1).Check(), Error);
  TrackingOptions inner;
  inner.keyframes.min_gap_frames = 0;
  EXPECT_THROW(inner.Check(), Error);
}

}  // namespace
}  // namespace deepuav
