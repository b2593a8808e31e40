#include "deepuav/geometry/rolling_shutter.h"

#include <gtest/gtest.h>

#include "deepuav/geometry/se3.h"

namespace deepuav {
namespace {

Camera WideCamera() {
  return {640, 480, {360, 364, 316, 242}, LensModel::kRadialTangential, {-0.28, 0.07, 2e-4, 1e-5},
          0};
}

const ReadoutMotion kMotion{{0.02, -0.01, 0.03}, {0.1, -0.2, 0.05}, {-0.01, 0.03, 0.02}};

/// The middle row's camera from the one of the row read at `moment`, turning faster and faster.
SE3 MiddleFromRow(double moment) {
  const Eigen::Vector3d turn_rad = moment * kMotion.turn_rad + moment * moment * kMotion.bend_rad;
  return SE3(RotationExp(turn_rad), moment * kMotion.travel);
}

TEST(RollingShutter, RowsAreReadFromFirstToLast) {
  EXPECT_EQ(RowMoment(0, 481), -0.5);
  EXPECT_EQ(RowMoment(240, 481), 0);
  EXPECT_EQ(RowMoment(480, 481), 0.5);
  EXPECT_EQ(RowMoment(-3, 481), -0.5);
  EXPECT_EQ(RowMoment(0, 1), 0);
}

TEST(RollingShutter, TheMiddleRowSeesWhatAnotherRowSaw) {
  const Camera camera = WideCamera();
  for (double moment : {-0.5, -0.2, 0.0, 0.3, 0.5}) {
    const Eigen::Vector3d point_row(1.5, -2, 7);
    const Eigen::Vector3d point_middle = MiddleFromRow(moment) * point_row;
    const Eigen::Vector2d px_row = camera.pinhole.Project(point_row);
    const Eigen::Vector2d px_middle = camera.pinhole.Project(point_middle);
    // The ray turned by the row's moment is as long as the depth that the row sees.
    EXPECT_LT((ToMiddleRow(camera.pinhole, px_row, moment, kMotion, 1 / point_row.z()) - px_middle)
                  .norm(),
              1e-9);
    EXPECT_LT(
        (FromMiddleRow(camera.pinhole, px_middle, moment, kMotion, 1 / point_middle.z()) - px_row)
            .norm(),
        1e-9);
    // Far away only turning counts.
    const Eigen::Vector3d far = 1e9 * point_row;
    EXPECT_LT((ToMiddleRow(camera.pinhole, camera.pinhole.Project(far), moment, kMotion) -
               camera.pinhole.Project(MiddleFromRow(moment) * far))
                  .norm(),
              1e-5);
  }
}

TEST(RollingShutter, ACameraAtRestSeesTheSameInEveryRow) {
  const Camera camera = WideCamera();
  const Eigen::Vector2d px(123.25, 45.5);
  EXPECT_EQ(ToMiddleRow(camera.pinhole, px, 0.4, {}, 0.1), px);
  EXPECT_EQ(FromMiddleRow(camera.pinhole, px, 0.4, {}, 0.1), px);
  EXPECT_EQ(DistortInRow(camera, px, {}, 0.1), camera.Distort(camera.pinhole.Unproject(px)));
}

TEST(RollingShutter, AnImageShowsAPointInTheRowThatWasReadThen) {
  const Camera camera = WideCamera();
  for (const Eigen::Vector3d& point_middle :
       {Eigen::Vector3d(2, 3, 6), {-3, -2, 5}, {0.1, 0, 4}, {1, -4, 9}}) {
    const auto image_px =
        DistortInRow(camera, camera.pinhole.Project(point_middle), kMotion, 1 / point_middle.z());
    ASSERT_TRUE(image_px);
    const double moment = RowMoment(image_px->y(), camera.height);
    const auto expected = camera.Distort(MiddleFromRow(moment).Inverse() * point_middle);
    ASSERT_TRUE(expected);
    EXPECT_LT((*image_px - *expected).norm(), 1e-3);
  }
  EXPECT_FALSE(DistortInRow(camera, {1e6, 0}, kMotion, 0.1));
}

TEST(RollingShutter, WhatWasCorrectedForOneMotionIsForAnother) {
  const Camera camera = WideCamera();
  const ReadoutMotion known{{-0.01, 0.02, 0.01}, {0.05, 0.1, 0}, {0, 0.01, 0}};
  constexpr double kInverseDepth = 0.2;
  for (const Eigen::Vector2d& px : {Eigen::Vector2d(40, 30), {320, 400}, {600, 240}}) {
    const auto image_px = DistortInRow(camera, px, known, kInverseDepth);
    ASSERT_TRUE(image_px);
    const auto other = ForOtherMotion(camera, px, known, kMotion, kInverseDepth);
    ASSERT_TRUE(other);
    // It is the same place of the image.
    EXPECT_LT((*DistortInRow(camera, *other, kMotion, kInverseDepth) - *image_px).norm(), 1e-3);
    EXPECT_LT((*ForOtherMotion(camera, *other, kMotion, known, kInverseDepth) - px).norm(), 1e-3);
    EXPECT_LT((*ForOtherMotion(camera, px, known, known, kInverseDepth) - px).norm(), 1e-9);
  }
  EXPECT_FALSE(ForOtherMotion(camera, {1e6, 0}, known, kMotion, kInverseDepth));
}

TEST(RollingShutter, MotionFollowsFromTwoPoses) {
  constexpr double kReadoutS = 0.02, kBetweenS = 0.1;
  const SE3 before_from_world(RotationExp({0.3, 0.1, -0.2}), Eigen::Vector3d(1, 2, 3));
  // By the second moment it went on by five readouts.
  const SE3 before_from_now(RotationExp(5 * kMotion.turn_rad), {0.5, -1, 0.25});
  const SE3 now_from_world = before_from_now.Inverse() * before_from_world;
  const ReadoutMotion motion =
      MotionInReadout(before_from_world, now_from_world, kBetweenS, kReadoutS);
  EXPECT_LT((motion.turn_rad - kMotion.turn_rad).norm(), 1e-12);
  EXPECT_TRUE(motion.bend_rad.isZero(0)) << "two poses do not tell it";
  const Eigen::Vector3d travel_before(0.1, -0.2, 0.05);
  EXPECT_LT((motion.travel - before_from_now.rotation().conjugate() * travel_before).norm(), 1e-12);
  // From a later moment back it is the same motion, in the axes of the earlier one.
  const ReadoutMotion back =
      MotionInReadout(now_from_world, before_from_world, -kBetweenS, kReadoutS);
  EXPECT_LT((back.turn_rad - kMotion.turn_rad).norm(), 1e-12);
  EXPECT_LT((back.travel - travel_before).norm(), 1e-12);
  EXPECT_TRUE(MotionInReadout(before_from_world, now_from_world, 0, kReadoutS).IsNone());
  EXPECT_TRUE(MotionInReadout(before_from_world, now_from_world, kBetweenS, 0).IsNone());
}

}  // namespace
}  // namespace deepuav
