#include "deepuav/mapping/camera/readout_change.h"

#include <gtest/gtest.h>

#include "support/straight_flight.h"

namespace deepuav {
namespace {

const ReadoutMotion kMotion{{0.01, -0.02, 0.015}, {0.2, -0.1, 0.05}, {0.005, 0, -0.01}};

/// A map of a camera with a rolling shutter that was taken to be at rest while it was read.
class ReadoutChangeTest : public testing::Test, protected StraightFlight {
 protected:
  ReadoutChangeTest() {
    Random random(3);
    made_ = MakeTrueMap(FeatureWorld(Ground(), 2), KeyframePoses(), {}, &random);
    camera_ = FeatureWorld(Ground(), 2).camera();
    camera_.readout_s = 0.02;
  }

  const Keyframe& Changed() const { return made_.map.At(made_.keyframes[2]); }
  const Observation& ObservationOf(LandmarkId landmark) const {
    return *std::ranges::find(made_.map.At(landmark).observations, Changed().id,
                              &Observation::keyframe);
  }
  double DepthOf(LandmarkId landmark) const {
    return (Changed().cam_from_world * made_.map.At(landmark).position_world).z();
  }

  Camera camera_;
  SyntheticMap made_;
};

TEST_F(ReadoutChangeTest, MovesKeypointsByTheTurnAndMeasurementsByTheirDepth) {
  const Keyframe before = Changed();
  const Keyframe other = made_.map.At(made_.keyframes[1]);
  ChangeMotions({{before.id, kMotion}}, camera_, &made_.map);
  EXPECT_EQ(Changed().motion().turn_rad, kMotion.turn_rad);
  EXPECT_EQ(Changed().motion().bend_rad, kMotion.bend_rad);
  EXPECT_EQ(Changed().motion().travel, kMotion.travel);
  int seen = 0;
  for (size_t i = 0; i < before.landmarks.size(); ++i) {
    const Eigen::Vector2d px = before.features().keypoints[i].px.cast<double>();
    const double moment = RowMoment(px.y(), camera_.height);
    const Eigen::Vector2d turned = ToMiddleRow(camera_.pinhole, px, moment, kMotion);
    EXPECT_LT((Changed().features().keypoints[i].px.cast<double>() - turned).norm(), 1e-3);
    const LandmarkId landmark = before.landmarks[i];
    if (!landmark.valid()) continue;
    const Eigen::Vector2d moved =
        ToMiddleRow(camera_.pinhole, px, moment, kMotion, 1 / DepthOf(landmark));
    EXPECT_LT((ObservationOf(landmark).measured.px.cast<double>() - moved).norm(), 1e-3);
    ++seen;
  }
  EXPECT_GT(seen, 50);
  EXPECT_TRUE(made_.map.At(other.id).motion().IsNone()) << "others stay";
  EXPECT_EQ(made_.map.At(other.id).frame.features, other.frame.features);
}

TEST_F(ReadoutChangeTest, MovesWhatPatchesMeasuredFromWhereItIs) {
  const LandmarkId landmark = *std::ranges::find_if(Changed().landmarks, &LandmarkId::valid);
  const PixelMeasurement by_patch{{200.25F, 30.5F}, 0.1, true};
  made_.map.SetMeasurement(Changed().id, landmark, by_patch);
  ChangeMotions({{Changed().id, kMotion}}, camera_, &made_.map);
  const PixelMeasurement& moved = ObservationOf(landmark).measured;
  const auto expected =
      ForOtherMotion(camera_, by_patch.px.cast<double>(), {}, kMotion, 1 / DepthOf(landmark));
  EXPECT_LT((moved.px.cast<double>() - *expected).norm(), 1e-3);
  EXPECT_EQ(moved.noise, by_patch.noise);
  EXPECT_TRUE(moved.by_patch);
}

TEST_F(ReadoutChangeTest, LeavesWhatLiesBehindTheCamera) {
  const LandmarkId landmark = *std::ranges::find_if(Changed().landmarks, &LandmarkId::valid);
  const Eigen::Vector2f px = ObservationOf(landmark).measured.px;
  made_.map.SetPosition(landmark, Changed().cam_from_world.Inverse() * Eigen::Vector3d(0, 0, -5));
  ChangeMotions({{Changed().id, kMotion}}, camera_, &made_.map);
  EXPECT_EQ(ObservationOf(landmark).measured.px, px);
}

TEST_F(ReadoutChangeTest, TravelsInTheUnitsOfAMapThatGrew) {
  made_.map.Rescale(4);
  ChangeMotions({{Changed().id, kMotion}}, camera_, &made_.map);
  EXPECT_LT((Changed().motion().travel - kMotion.travel).norm(), 1e-12);
  EXPECT_LT((Changed().frame.motion.travel - kMotion.travel / 4).norm(), 1e-12);
}

TEST_F(ReadoutChangeTest, LeadsBack) {
  const Keyframe before = Changed();
  ChangeMotions({{before.id, kMotion}}, camera_, &made_.map);
  ChangeMotions({{before.id, ReadoutMotion{}}}, camera_, &made_.map);
  for (size_t i = 0; i < before.landmarks.size(); ++i) {
    const Eigen::Vector2f px = before.features().keypoints[i].px;
    EXPECT_LT((Changed().features().keypoints[i].px - px).norm(), 1e-3F);
    if (before.landmarks[i].valid()) {
      EXPECT_LT((ObservationOf(before.landmarks[i]).measured.px - px).norm(), 1e-2F);
    }
  }
}

}  // namespace
}  // namespace deepuav
