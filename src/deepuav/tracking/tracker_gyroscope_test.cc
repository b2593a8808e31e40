#include <gtest/gtest.h>

#include "deepuav/tracking/tracker.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

constexpr FeatureNoise kNoise{0.5, 0.3, 0, 30};

/// Finds nothing: only a prediction can tell where a frame is.
class BlindMatcher : public Matcher {
 public:
  std::vector<Match> MatchFeatures(const Features& /*a*/, const Features& /*b*/) override {
    return {};
  }
  std::string Description() const override { return "blind"; }
};

/// A camera before a wall of landmarks, of which there is a true map. It flies past it and turns to
/// and fro, farther from frame to frame than a window reaches.
class TrackerGyroscopeTest : public testing::Test {
 protected:
  TrackerGyroscopeTest() {
    std::vector<SE3> poses;
    for (int i = 0; i < 6; ++i)
      poses.push_back(SE3(Eigen::Quaterniond::Identity(), -Eigen::Vector3d(0.4 * i, 0, 0)));
    made_.emplace(MakeTrueMap(world_, poses, kNoise, &random_));
    tracker_.Begin(MakeLocalMap(made_->map, made_->keyframes[5], {}));
  }

  static FeatureWorld MakeWorld() {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksInBox(1200, {-14, -6, 6}, {16, 6, 20}, &random);
    return FeatureWorld(geometry, 2);
  }

  static SE3 PoseAt(int64_t i) {
    const Eigen::Quaterniond rotation = RotationExp({0, i % 4 < 2 ? 0.08 : -0.08, 0});
    return SE3(rotation, -(rotation * Eigen::Vector3d(1.8 + 0.02 * static_cast<double>(i), 0, 0)));
  }
  Frame FrameAt(int64_t i, const SyntheticView& view, bool with_gyroscope) const {
    Frame frame = FrameOf(i, view);
    if (with_gyroscope)
      frame.turn_since_before = PoseAt(i).rotation() * PoseAt(i - 1).rotation().conjugate();
    return frame;
  }
  TrackingResult Track(int64_t i, bool with_gyroscope) {
    return tracker_.Track(FrameAt(i, world_.View(PoseAt(i), kNoise, &random_), with_gyroscope),
                          false);
  }
  TrackingResult TrackNothing(int64_t i, bool with_gyroscope) {
    SyntheticView view;
    view.features = std::make_shared<const Features>(
        RandomFeatures(300, 752, 480, FeatureWorld::kDimension, &random_));
    return tracker_.Track(FrameAt(i, view, with_gyroscope), false);
  }
  double ErrorOf(const TrackingResult& result, int64_t i) const {
    return (made_->map.PoseOf(result.pose->anchored) * PoseAt(i).Inverse()).Log().norm();
  }
  /// What tracking begins with: the frame is found in a map, somehow.
  void FoundAt(int64_t i) {
    LocatedFrame located;
    located.cam_from_world = PoseAt(i);
    for (int k = 0; k < 200; ++k) located.seen.push_back({k, k});
    tracker_.Resume(FrameOf(i, world_.View(PoseAt(i), kNoise, &random_)),
                    MakeLocalMap(made_->map, made_->keyframes[5], {}), located);
  }

  Random random_{3};
  const FeatureWorld world_ = MakeWorld();
  std::optional<SyntheticMap> made_;
  BlindMatcher matcher_;
  Tracker tracker_{world_.camera(), {}, &matcher_, nullptr};
};

TEST_F(TrackerGyroscopeTest, FollowsQuickTurns) {
  FoundAt(0);
  for (int64_t i = 1; i < 20; ++i) {
    const TrackingResult result = Track(i, true);
    ASSERT_TRUE(result.pose) << i << ": " << result.reason;
    EXPECT_LT(ErrorOf(result, i), 0.02) << i;
  }
}

TEST_F(TrackerGyroscopeTest, WithoutOneTheyAreTooQuick) {
  FoundAt(0);
  EXPECT_TRUE(Track(1, false).pose);
  EXPECT_FALSE(Track(2, false).pose);
}

TEST_F(TrackerGyroscopeTest, FindsTheMapAgainAfterFramesThatShowedNothing) {
  FoundAt(0);
  for (int64_t i = 1; i < 8; ++i) ASSERT_TRUE(Track(i, true).pose) << i;
  for (int64_t i = 8; i < 14; ++i)
    EXPECT_EQ(TrackNothing(i, true).state, TrackingState::kLost) << i;
  const TrackingResult found = Track(14, true);
  ASSERT_TRUE(found.pose) << found.reason;
  EXPECT_LT(ErrorOf(found, 14), 0.02);
  const TrackingResult next = Track(15, true);
  ASSERT_TRUE(next.pose) << next.reason;
  EXPECT_LT(ErrorOf(next, 15), 0.02);
}

TEST_F(TrackerGyroscopeTest, StaysLostWhereATurnIsMissing) {
  FoundAt(0);
  for (int64_t i = 1; i < 8; ++i) ASSERT_TRUE(Track(i, true).pose) << i;
  TrackNothing(8, true);
  TrackNothing(9, false);
  EXPECT_EQ(Track(10, true).state, TrackingState::kLost);
}

TEST_F(TrackerGyroscopeTest, WhatOnlyLooksAlikeIsNoPose) {
  FoundAt(0);
  for (int64_t i = 1; i < 8; ++i) ASSERT_TRUE(Track(i, true).pose) << i;
  TrackNothing(8, true);
  for (int64_t i = 9; i < 14; ++i)
    EXPECT_FALSE(TrackNothing(i, true).pose) << "clutter in wide windows, frame " << i;
}

}  // namespace
}  // namespace deepuav
