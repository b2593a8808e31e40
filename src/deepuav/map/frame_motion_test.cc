#include "deepuav/map/frame_motion.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

namespace deepuav {
namespace {

Camera RollingCamera() {
  Camera camera{640, 481, {400, 400, 320, 240}, LensModel::kPinhole, {}, 0};
  camera.readout_s = 0.02;
  return camera;
}

Frame FrameWithKeypoints() {
  Features features;
  for (float y : {20.f, 240.f, 400.f}) features.keypoints.push_back({{300, y}, {300, y}, 1, 1});
  return {FrameId{1}, {}, std::make_shared<const Features>(std::move(features))};
}

const SE3 kThen(RotationExp({0.1, -0.05, 0.02}), Eigen::Vector3d(0.3, -0.2, 0.1));

TEST(FrameMotion, AnotherMotionTakesThePlaceOfTheFormerOne) {
  const Camera camera = RollingCamera();
  const Frame raw = FrameWithKeypoints();
  const ReadoutMotion first{{0.01, 0.02, -0.01}, {1, 2, 3}, {0, 0.03, 0}},
      second{{-0.02, 0.01, 0.03}, {0, 0, 0}, {0.01, 0, -0.02}};
  const Frame direct = WithMotion(raw, second, camera);
  const Frame again = WithMotion(WithMotion(raw, first, camera), second, camera);
  const Frame back = WithMotion(direct, {}, camera);
  for (size_t i = 0; i < 3; ++i) {
    const Keypoint& keypoint = direct.features->keypoints[i];
    EXPECT_LT((again.features->keypoints[i].px - keypoint.px).norm(), 1e-3f);
    EXPECT_LT((back.features->keypoints[i].px - raw.features->keypoints[i].px).norm(), 1e-3f);
    EXPECT_EQ(keypoint.image_px, raw.features->keypoints[i].image_px);
  }
  EXPECT_GT((direct.features->keypoints[0].px - raw.features->keypoints[0].px).norm(), 2);
  EXPECT_EQ(direct.features->keypoints[1].px, raw.features->keypoints[1].px) << "the middle row";
}

TEST(FrameMotion, OneThatDiffersByItsBendAloneTakesItsPlace) {
  const Camera camera = RollingCamera();
  const ReadoutMotion steady{{0.01, 0.02, -0.01}, {0, 0, 0}, {0, 0, 0}};
  ReadoutMotion bent = steady;
  bent.bend_rad = {0, 0.04, 0};
  const Frame frame = WithMotion(FrameWithKeypoints(), steady, camera);
  const Frame other = WithMotion(frame, bent, camera);
  // Rows on both sides of the middle one are off to the same side.
  const float above = other.features->keypoints[0].px.x() - frame.features->keypoints[0].px.x();
  const float below = other.features->keypoints[2].px.x() - frame.features->keypoints[2].px.x();
  EXPECT_GT(std::abs(above), 0.5f);
  EXPECT_GT(above * below, 0.25f);
}

TEST(FrameMotion, ACameraGoesOnAsItCame) {
  const Camera camera = RollingCamera();
  const Frame moving = MovingOn(FrameWithKeypoints(), SE3(), kThen, 0.1, camera);
  const ReadoutMotion expected = MotionInReadout(kThen, SE3(), 0.1, camera.readout_s);
  EXPECT_EQ(moving.motion.turn_rad, expected.turn_rad);
  EXPECT_EQ(moving.motion.travel, expected.travel);
  EXPECT_GT(moving.motion.turn_rad.norm(), 0.01);
}

TEST(FrameMotion, AMeasuredTurnStays) {
  const Camera camera = RollingCamera();
  Frame frame = WithMotion(FrameWithKeypoints(), {{0.01, 0, 0}, {0, 0, 0}, {0, 0.02, 0}}, camera);
  frame.turn_is_measured = true;
  const Frame moving = MovingOn(frame, SE3(), kThen, 0.1, camera);
  EXPECT_TRUE(moving.motion.TurnsAs(frame.motion));
  EXPECT_EQ(moving.features, frame.features);
  EXPECT_GT(moving.motion.travel.norm(), 0.01);
}

TEST(FrameMotion, AllRowsAtOnceNeedNoCorrection) {
  Camera camera = RollingCamera();
  camera.readout_s = 0;
  const Frame frame = FrameWithKeypoints();
  const Frame moving = MovingOn(frame, SE3(), kThen, 0.1, camera);
  EXPECT_TRUE(moving.motion.IsNone());
  EXPECT_EQ(moving.features, frame.features);
}

}  // namespace
}  // namespace deepuav
