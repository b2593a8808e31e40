#include "deepuav/system/finish/path_smoothing.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "support/straight_flight.h"

namespace deepuav {
namespace {

/// A map of a straight flight, and records of its frames as the end of a run finds them.
class PathSmoothingTest : public testing::Test, protected StraightFlight {
 protected:
  static constexpr double kSigma = 0.03;

  PathSmoothingTest() {
    SyntheticMap made = MakeTrueMap(world_, KeyframePoses(), {0.5, 0.3, 0, 30}, &random_);
    keyframes_ = made.keyframes;
    atlas_.Add(std::move(made.map));
    for (int i = 0; i < kFrames; ++i) records_.push_back(Located(i));
  }

  FrameRecord Located(int i) {
    const Map& map = atlas_.At(MapId{0});
    const Keyframe& near = map.At(keyframes_[KeyframeOf(i)]);
    FrameRecord record;
    record.id = FrameId{1000 + i};
    record.time = Timestamp{i * 100'000'000LL};
    record.map = MapId{0};
    record.landmark_count = 200;
    Vector6d error;
    for (double& e : error) e = random_.Gaussian(kSigma);
    record.cam_from_world = SE3::Exp(error) * PoseAt(i);
    record.pose = {near.id, record.cam_from_world * near.cam_from_world.Inverse(), near.scale};
    record.pose_information = Matrix6d::Identity() / (kSigma * kSigma);
    return record;
  }
  /// As of a frame that sees little.
  void Spoil(size_t i) {
    FrameRecord& record = records_[i];
    record.landmark_count = 20;
    record.pose_information = Matrix6d::Identity() / 0.25;
    record.cam_from_world =
        SE3::Exp((Vector6d() << 0.5, 0.4, -0.3, 0.02, 0, 0).finished()) * record.cam_from_world;
  }
  void Smooth() { PathSmoothing(options_, atlas_).Smooth(&records_); }
  double Error(size_t i) const {
    return PositionError(records_[i].cam_from_world, static_cast<int>(i));
  }

  const FeatureWorld world_{Ground(), 2};
  Random random_{3};
  Atlas atlas_;
  std::vector<KeyframeId> keyframes_;
  std::vector<FrameRecord> records_;
  PathSmoothingOptions options_;
};

TEST_F(PathSmoothingTest, AFrameThatSeesLittleFollowsThoseAroundIt) {
  Spoil(7);
  const double before = Error(7);
  ASSERT_GT(before, 0.3);
  Smooth();
  EXPECT_LT(Error(7), 0.25 * before);
}

TEST_F(PathSmoothingTest, KeyframesAndWhatIsReckonedStay) {
  records_[3].id = atlas_.At(MapId{0}).At(records_[3].pose.keyframe).frame.id;
  records_[5].reckoned = true;
  const SE3 keyframe = records_[3].cam_from_world, reckoned = records_[5].cam_from_world;
  const SE3 other = records_[6].cam_from_world;
  Smooth();
  EXPECT_EQ(records_[3].cam_from_world.Matrix(), keyframe.Matrix());
  EXPECT_EQ(records_[5].cam_from_world.Matrix(), reckoned.Matrix());
  EXPECT_NE(records_[6].cam_from_world.Matrix(), other.Matrix());
}

TEST_F(PathSmoothingTest, AFrameOfWhichIsNotKnownHowWellStays) {
  records_[5].pose_information.setZero();
  const SE3 before = records_[5].cam_from_world;
  Smooth();
  EXPECT_EQ(records_[5].cam_from_world.Matrix(), before.Matrix());
}

TEST_F(PathSmoothingTest, NothingIsHeldAcrossALongGap) {
  for (size_t i = 8; i < records_.size(); ++i) records_[i].time.nanoseconds += 60'000'000'000LL;
  const SE3 first_half = records_[7].cam_from_world;
  std::vector<FrameRecord> alone(records_.begin(), records_.begin() + 8);
  PathSmoothing(options_, atlas_).Smooth(&alone);
  Smooth();
  EXPECT_NE(records_[7].cam_from_world.Matrix(), first_half.Matrix());
  EXPECT_EQ(records_[7].cam_from_world.Matrix(), alone[7].cam_from_world.Matrix());
}

TEST_F(PathSmoothingTest, DoesNothingWhereAskedNotTo) {
  options_.path.enabled = false;
  const SE3 before = records_[6].cam_from_world;
  Smooth();
  EXPECT_EQ(records_[6].cam_from_world.Matrix(), before.Matrix());
}

TEST_F(PathSmoothingTest, FewFramesAndFewFirmOnesStayAsTheyAre) {
  for (FrameRecord& record : records_) record.landmark_count = 10;
  const SE3 before = records_[6].cam_from_world;
  Smooth();
  EXPECT_EQ(records_[6].cam_from_world.Matrix(), before.Matrix());
  records_.resize(1);
  Smooth();
  records_.clear();
  Smooth();
}

TEST(PathSmoothingOptions, OutOfRangeAreRefused) {
  PathSmoothingOptions options;
  options.max_step = 0;
  EXPECT_THROW(options.Check(), Error);
}

}  // namespace
}  // namespace deepuav
