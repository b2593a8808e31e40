#include "deepuav/tracking/tracker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/tracking/testing/tracker_fixture.h"
#include "support/options_with.h"

namespace deepuav {
namespace {

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

TEST(TrackingOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(TrackingOptions().Check());
  EXPECT_THROW(OptionsWith(&TrackingOptions::max_lost_frames, -1).Check(), Error);
  TrackingOptions inner;
  inner.keyframes.min_gap_frames = 0;
  EXPECT_THROW(inner.Check(), Error);
}

}  // namespace
}  // namespace deepuav
