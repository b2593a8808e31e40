#include "deepuav/system/finish/trajectory_finish.h"

#include <gtest/gtest.h>

#include "deepuav/matching/nearest_neighbour.h"
#include "support/straight_flight.h"

namespace deepuav {
namespace {

/// A map of a straight flight, and records of its frames as tracking left them.
class TrajectoryFinishTest : public testing::Test, protected StraightFlight {
 protected:
  TrajectoryFinishTest() {
    SyntheticMap made = MakeTrueMap(world_, KeyframePoses(), {0.5, 0.3, 0, 30}, &random_);
    keyframes_ = made.keyframes;
    landmark_of_ = made.landmark_of;
    atlas_.Add(std::move(made.map));
    for (int i = 0; i < kFrames; ++i) records_.push_back(Tracked(i));
  }

  FrameRecord Tracked(int i) {
    const SyntheticView view = world_.View(PoseAt(i), {0.5, 0.3, 0, 50}, &random_);
    const Frame frame = FrameOf(1000 + i, view);
    TrackingResult result;
    result.state = TrackingState::kTracking;
    const KeyframeId near = keyframes_[KeyframeOf(i)];
    const SE3 near_from_world = atlas_.At(MapId{0}).At(near).cam_from_world;
    result.pose = TrackedPose{MapId{0}, {near, PoseAt(i) * near_from_world.Inverse(), 1}, {}};
    for (size_t k = 0; k < view.landmark.size(); ++k) {
      if (view.landmark[k] < 0) continue;
      const LandmarkId landmark = landmark_of_[static_cast<size_t>(view.landmark[k])];
      if (landmark.valid()) result.pose->matches.push_back({static_cast<int>(k), landmark});
    }
    FrameRecord record = MakeRecord(frame, result);
    record.cam_from_world = PoseAt(i);
    features_.push_back(record.features);
    record.features.reset();
    return record;
  }

  /// As of a frame whose few landmarks speak for a wrong pose.
  void Spoil(size_t i) {
    FrameRecord& record = records_[i];
    record.seen.resize(20);
    record.landmark_count = 20;
    record.pose.cam_from_keyframe =
        SE3(record.pose.cam_from_keyframe.rotation(), Eigen::Vector3d(0.5, 0.2, 0));
    for (FrameRecord::Seen& seen : record.seen) seen.measured.px += Eigen::Vector2f(25, 5);
    record.features = features_[i];
  }

  void Lose(size_t i) {
    FrameRecord lost;
    lost.id = records_[i].id;
    lost.time = records_[i].time;
    lost.features = features_[i];
    records_[i] = lost;
  }

  void Finish() {
    FrameLocator locator(world_.camera(), {}, &matcher_, nullptr);
    const TrajectoryFinish finish(world_.camera(), {}, {}, 10, atlas_, KeyframeId{0}, &locator);
    finish.LocateDoubtful(&records_);
    finish.Finish(&records_);
  }

  double Error(size_t i) const {
    return PositionError(records_[i].cam_from_world, static_cast<int>(i));
  }

  const FeatureWorld world_{Ground(), 2};
  Random random_{3};
  NearestNeighbourMatcher matcher_{{}};
  Atlas atlas_;
  std::vector<KeyframeId> keyframes_;
  std::vector<LandmarkId> landmark_of_;
  std::vector<FrameRecord> records_;
  std::vector<std::shared_ptr<const Features>> features_;
};

TEST_F(TrajectoryFinishTest, AFrameThatSeesLittleIsLocatedBetweenItsNeighbours) {
  Spoil(12);
  Finish();
  EXPECT_LT(Error(12), 0.03);
  EXPECT_GT(records_[12].landmark_count, 100);
}

TEST_F(TrajectoryFinishTest, TheFirstFrameTrackedIsLocatedFromTheNextOnes) {
  for (size_t i = 0; i < 3; ++i) Lose(i);
  Spoil(3);
  Finish();
  EXPECT_LT(Error(3), 0.03);
  EXPECT_GT(records_[3].landmark_count, 100);
  for (size_t i = 0; i < 3; ++i) EXPECT_LT(Error(i), 0.03) << "found from the frame after it";
}

TEST_F(TrajectoryFinishTest, TheLastFrameTrackedIsLocatedFromThoseBefore) {
  Spoil(kFrames - 1);
  Finish();
  EXPECT_LT(Error(kFrames - 1), 0.03);
  EXPECT_GT(records_.back().landmark_count, 100);
}

TEST_F(TrajectoryFinishTest, FramesOfWhichNothingLastedAreLocatedOneAfterAnother) {
  // As while a map is young: what they saw is gone, and all of them stand where it put them.
  for (size_t i = 5; i < 12; ++i) {
    Spoil(i);
    for (FrameRecord::Seen& seen : records_[i].seen) seen.landmark = {};
  }
  Finish();
  for (size_t i = 5; i < 12; ++i) EXPECT_LT(Error(i), 0.03) << i;
}

TEST_F(TrajectoryFinishTest, ADoubtfulFrameKeepsItsFeaturesUntilAllIsFinished) {
  Spoil(12);
  FrameLocator locator(world_.camera(), {}, &matcher_, nullptr);
  const TrajectoryFinish finish(world_.camera(), {}, {}, 10, atlas_, KeyframeId{0}, &locator);
  finish.LocateDoubtful(&records_);
  EXPECT_LT(Error(12), 0.03);
  EXPECT_EQ(records_[12].features, features_[12]) << "its map may yet turn out to be a brief one";
  finish.Finish(&records_);
  EXPECT_LT(Error(12), 0.03);
  EXPECT_FALSE(records_[12].features);
}

TEST_F(TrajectoryFinishTest, ASureFrameStaysThoughItHasFeatures) {
  Spoil(12);
  records_[12].is_sure = true;
  FrameLocator locator(world_.camera(), {}, &matcher_, nullptr);
  const TrajectoryFinish finish(world_.camera(), {}, {}, 10, atlas_, KeyframeId{0}, &locator);
  finish.LocateDoubtful(&records_);
  EXPECT_EQ(records_[12].landmark_count, 20);
  EXPECT_EQ(records_[12].features, features_[12]);
}

TEST_F(TrajectoryFinishTest, AFrameWithoutNeighboursStaysAsItIs) {
  for (size_t i : {11, 13}) {
    Lose(i);
    records_[i].features.reset();
  }
  Spoil(12);
  Finish();
  EXPECT_EQ(records_[12].landmark_count, 20);
  EXPECT_GT(Error(12), 0.2);
  EXPECT_FALSE(records_[12].features);
}

TEST_F(TrajectoryFinishTest, AFrameThatSeesNoMoreInTheFinishedMapKeepsItsLandmarks) {
  records_[12].features = features_[12];
  records_[12].landmark_count = 100000;
  Finish();
  EXPECT_EQ(records_[12].landmark_count, 100000);
  EXPECT_LT(Error(12), 0.03);
}

}  // namespace
}  // namespace deepuav
