#include "deepuav/system/finish/gap_bridge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/matching/nearest_neighbour.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

constexpr int kFrames = 40, kTurnStarts = 10, kTurnEnds = 30, kBlind = 14, kSees = 27;
constexpr int64_t kNanosecondsAFrame = 100'000'000;
constexpr double kHeight = 10;

/// A camera that hovers, drifting a little, and turns about by half a turn in two seconds. What it
/// sees at first and in the end is in the map, what lies between is not.
SE3 PoseAt(double i) {
  const double along = std::clamp((i - kTurnStarts) / double{kTurnEnds - kTurnStarts}, 0.0, 1.0);
  const double heading = M_PI * along * along * (3 - 2 * along);
  const Eigen::Vector3d centre(0.05 * std::sin(0.1 * i), 0.05 * std::cos(0.13 * i),
                               kHeight + 0.003 * i);
  const Eigen::Vector3d ahead(std::cos(heading), std::sin(heading), -1);
  return LookAt(centre, centre + ahead, {0, 0, 1});
}

SyntheticWorld Ground() {
  Random random(1);
  SyntheticWorld world;
  world.landmarks_world = LandmarksOnGround(6000, {-30, -30}, {30, 30}, 1, &random);
  return world;
}

class GapBridgeTest : public testing::Test {
 protected:
  /// `slower`: how many times as long all takes, in as many times as many frames.
  explicit GapBridgeTest(int slower = 1) : slower_(slower) {
    std::vector<SE3> poses;
    for (const int i : {0, kFrames}) {
      for (const double aside : {-1, 0, 1}) {
        const SE3 pose = PoseAt(i);
        poses.emplace_back(pose.rotation(), pose.translation() + Eigen::Vector3d(aside, 0, 0));
      }
    }
    SyntheticMap made = MakeTrueMap(world_, poses, {0.5, 0.3, 0, 30}, &random_);
    keyframes_ = made.keyframes;
    landmark_of_ = made.landmark_of;
    atlas_.Add(std::move(made.map));
    for (int i = 0; i < kFrames * slower; ++i) records_.push_back(Tracked(i));
  }

  SE3 TruePose(int i) const { return PoseAt(static_cast<double>(i) / slower_); }

  FrameRecord Tracked(int i) {
    const SyntheticView view = world_.View(TruePose(i), {0.5, 0.3, 0, 100}, &random_);
    TrackingResult result;
    result.state = TrackingState::kTracking;
    const KeyframeId near = keyframes_[i < kTurnEnds * slower_ ? 1 : 4];
    const SE3 near_from_world = atlas_.At(MapId{0}).At(near).cam_from_world;
    result.pose = TrackedPose{MapId{0}, {near, TruePose(i) * near_from_world.Inverse(), 1}, {}};
    for (size_t k = 0; k < view.landmark.size(); ++k) {
      if (view.landmark[k] < 0) continue;
      const LandmarkId landmark = landmark_of_[static_cast<size_t>(view.landmark[k])];
      if (landmark.valid()) result.pose->matches.push_back({static_cast<int>(k), landmark});
    }
    FrameRecord record = MakeRecord(FrameOf(1000 + i, view, kNanosecondsAFrame), result);
    record.cam_from_world = TruePose(i);
    record.landmark_count = 200;
    features_.push_back(record.features);
    return record;
  }

  void Lose(int from, int to) {
    for (int i = from; i < to; ++i) {
      FrameRecord lost;
      lost.id = records_[static_cast<size_t>(i)].id;
      lost.time = records_[static_cast<size_t>(i)].time;
      lost.state = TrackingState::kLost;
      records_[static_cast<size_t>(i)] = lost;
    }
  }
  /// Of key points that show nothing.
  void Blind(int from, int to) {
    for (int i = from; i < to; ++i)
      features_[static_cast<size_t>(i)] = std::make_shared<const Features>(
          RandomFeatures(100, 752, 480, FeatureWorld::kDimension, &random_));
  }

  int Bridge(const GapOptions& options = {}) {
    return GapBridge({world_.camera(), {}, {}, &matcher_}, options, atlas_, features_)
        .Bridge(&records_);
  }

  const FrameRecord& At(int i) const { return records_[static_cast<size_t>(i)]; }
  double Distance(int i) const {
    return (At(i).cam_from_world.InverseTranslation() - TruePose(i).InverseTranslation()).norm();
  }
  double TurnDeg(int i) const {
    return (At(i).cam_from_world * TruePose(i).Inverse()).Angle() * 180 / M_PI;
  }
  int LostBetween(int from, int to) const {
    int lost = 0;
    for (int i = from; i < to; ++i) lost += !At(i).located();
    return lost;
  }

  const int slower_;
  const FeatureWorld world_{Ground(), 2};
  Random random_{3};
  NearestNeighbourMatcher matcher_{{}};
  Atlas atlas_;
  std::vector<KeyframeId> keyframes_;
  std::vector<LandmarkId> landmark_of_;
  std::vector<FrameRecord> records_;
  std::vector<std::shared_ptr<const Features>> features_;
};

TEST_F(GapBridgeTest, ATurnOnTheSpotIsFollowedThroughWhatIsNotInTheMap) {
  Lose(kBlind, kSees);
  EXPECT_EQ(Bridge(), kSees - kBlind);
  for (int i = kBlind; i < kSees; ++i) {
    EXPECT_TRUE(At(i).inferred);
    EXPECT_LT(TurnDeg(i), 0.2) << i;
    EXPECT_LT(Distance(i), 0.02 * kHeight) << i;
    EXPECT_LT((atlas_.At(MapId{0}).PoseOf(At(i).pose) * At(i).cam_from_world.Inverse()).Angle(),
              1e-9);
    const double sigma = std::sqrt(At(i).pose_information.inverse()(3, 3));
    EXPECT_LT(sigma, 0.01);
    EXPECT_GT(sigma, 1e-5);
  }
  EXPECT_FALSE(At(kBlind - 1).inferred);
}

struct SlowGapBridgeTest : GapBridgeTest {
  SlowGapBridgeTest() : GapBridgeTest(4) {}
};

TEST_F(SlowGapBridgeTest, ATurnIsFollowedForAsLongAsItTakes) {
  const int first = 4 * kBlind, last = 4 * kSees;
  Lose(first, last);
  EXPECT_EQ(Bridge(), last - first);
  for (int i = first; i < last; ++i) {
    EXPECT_LT(TurnDeg(i), 0.3) << i;
    EXPECT_LT(Distance(i), 0.02 * kHeight) << i;
    const Matrix6d covariance = At(i).pose_information.inverse();
    EXPECT_LT(std::sqrt(covariance.topLeftCorner<3, 3>().trace()), 0.02 * kHeight) << i;
  }
}

TEST_F(SlowGapBridgeTest, WhatIsNotSeenOnTheWayStaysLostThoughItsEndsAreLinked) {
  const int first = 4 * kBlind, last = 4 * kSees, dark = 70, light = 77;
  Lose(first, last);
  Blind(dark, light);
  EXPECT_EQ(Bridge(), last - first - (light - dark));
  EXPECT_EQ(LostBetween(dark, light), light - dark);
}

TEST_F(GapBridgeTest, WhereNothingIsSeenAShortGapIsBridgedAndALongOneNot) {
  Lose(4, 6);
  Blind(4, 6);
  Lose(kBlind, kSees);
  Blind(kBlind, kSees);
  EXPECT_EQ(Bridge(), 2);
  for (int i = 4; i < 6; ++i) EXPECT_LT(Distance(i), 0.01 * kHeight);
  EXPECT_EQ(LostBetween(kBlind, kSees), kSees - kBlind);
}

TEST_F(GapBridgeTest, WithoutFeaturesNothingIsSeen) {
  Lose(kBlind, kSees);
  features_.assign(features_.size(), nullptr);
  EXPECT_EQ(Bridge(), 0);
}

TEST_F(GapBridgeTest, PosesThatContradictEachOtherAreNotBridged) {
  Lose(5, 9);
  for (int i = 9; i < kFrames; ++i) {
    SE3& pose = records_[static_cast<size_t>(i)].cam_from_world;
    pose = SE3(pose.rotation(), pose.translation() + Eigen::Vector3d(3, 0, 0));
  }
  EXPECT_EQ(Bridge(), 0);
  EXPECT_EQ(LostBetween(5, 9), 4);
}

TEST_F(GapBridgeTest, FewLandmarksPlaceAFrame) {
  Lose(4, 7);
  Blind(4, 7);
  const SyntheticView view = world_.View(PoseAt(5), {0.5, 0.3, 0, 0}, &random_);
  Features few{{}, Descriptors(FeatureWorld::kDimension)};
  for (size_t k = 0; k < view.landmark.size() && few.size() < 8; k += 20) {
    few.keypoints.push_back(view.features->keypoints[k]);
    few.descriptors.AppendFrom(view.features->descriptors, static_cast<int>(k));
  }
  features_[5] = std::make_shared<const Features>(few);
  EXPECT_EQ(Bridge(), 3);
  EXPECT_GE(At(5).landmark_count, 4);
  EXPECT_LT(TurnDeg(5), 0.3);
  EXPECT_LT(Distance(5), 0.005 * kHeight);
}

TEST_F(GapBridgeTest, AnUncertainPoseStaysLost) {
  Lose(kBlind, kSees);
  EXPECT_EQ(Bridge({.max_position_sigma = 1e-6}), 0);
  EXPECT_EQ(Bridge({.max_turn_sigma_deg = 1e-6}), 0);
  EXPECT_EQ(LostBetween(kBlind, kSees), kSees - kBlind);
}

TEST_F(GapBridgeTest, AFrameBesideAGapThatSeesFewLandmarksIsPlacedAnew) {
  Lose(kBlind, kSees);
  FrameRecord& weak = records_[kBlind - 1];
  weak.landmark_count = 12;
  weak.seen.resize(12);
  weak.cam_from_world = SE3(weak.cam_from_world.rotation(),
                            weak.cam_from_world.translation() + Eigen::Vector3d(0.3, 0.2, 0.2));
  EXPECT_EQ(Bridge(), kSees - kBlind);
  EXPECT_LT(Distance(kBlind - 1), 0.01 * kHeight);
  EXPECT_FALSE(At(kBlind - 1).inferred);
}

TEST_F(GapBridgeTest, AKeyframeStaysUnlessItCannotBeWhereItIs) {
  Lose(kBlind, kSees);
  const int near = kBlind - 2, far = kBlind - 1;
  for (const int i : {near, far}) {
    FrameRecord& weak = records_[static_cast<size_t>(i)];
    weak.landmark_count = 12;
    weak.seen.clear();
    const Eigen::Vector3d off(i == far ? 20 : 0.001, 0, 0);
    weak.cam_from_world = SE3(PoseAt(i).rotation(), PoseAt(i).translation() + off);
    const Frame frame{weak.id, weak.time, features_[static_cast<size_t>(i)]};
    atlas_.At(MapId{0}).AddKeyframe(KeyframeId{100 + i}, frame, weak.cam_from_world);
  }
  EXPECT_EQ(Bridge(), kSees - kBlind);
  EXPECT_NEAR(Distance(near), 0.001, 1e-9);
  EXPECT_LT(Distance(far), 0.02 * kHeight);
}

TEST_F(GapBridgeTest, AskedToStopItLeavesTheStretchAtHand) {
  Lose(kBlind, kSees);
  int asked = 0;
  const GapBridge bridge({world_.camera(), {}, {}, &matcher_}, {}, atlas_, features_);
  EXPECT_EQ(bridge.Bridge(&records_, [&asked] { return ++asked > 5; }), 0);
  EXPECT_EQ(LostBetween(kBlind, kSees), kSees - kBlind);
  EXPECT_LT(asked, 12) << "one a frame, had it gone on";
}

TEST_F(GapBridgeTest, GapsThatAreTooLongOrAtAnEndOrNotWantedStay) {
  Lose(kBlind, kSees);
  EXPECT_EQ(Bridge({.max_gap_s = 1}), 0);
  EXPECT_EQ(Bridge({.enabled = false}), 0);
  Lose(0, kBlind);
  EXPECT_EQ(Bridge({.max_gap_s = 10}), 0);
}

TEST(FindPathGaps, FramesThatSeeFewBesideGapsAreOneStretchWithThem) {
  Atlas atlas;
  Random random(1);
  const FeatureWorld world(Ground(), 2);
  atlas.Add(MakeTrueMap(world, {PoseAt(0)}, {}, &random).map);
  std::vector<FrameRecord> records(20);
  for (size_t i = 0; i < records.size(); ++i) {
    records[i].time = Timestamp{static_cast<int64_t>(i) * kNanosecondsAFrame};
    records[i].map = MapId{0};
    records[i].landmark_count = i >= 4 && i <= 12 ? 30 : 200;
  }
  for (const size_t i : {6, 7, 10}) records[i].map = {};
  const auto stretches = FindPathGaps(atlas, records, {2, 1, 100});
  ASSERT_EQ(stretches.size(), 1u);
  EXPECT_EQ(stretches[0].first, 2u);
  EXPECT_EQ(stretches[0].last, 14u);
  for (size_t i = 2; i <= 14; ++i) EXPECT_EQ(stretches[0].holds[i - 2], i < 4 || i > 12) << i;
  const auto without_rims = FindPathGaps(atlas, records, {2, 1, 0});
  ASSERT_EQ(without_rims.size(), 1u);
  EXPECT_EQ(without_rims[0].first, 4u);
  EXPECT_EQ(without_rims[0].last, 12u);
  EXPECT_TRUE(FindPathGaps(atlas, records, {0.05, 1, 100}).empty());
}

}  // namespace
}  // namespace deepuav
