#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "deepuav/tracking/testing/tracker_fixture.h"

namespace deepuav {
namespace {

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

}  // namespace
}  // namespace deepuav
