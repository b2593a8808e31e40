#include "deepuav/evaluation/measures/ate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "support/flights.h"

namespace deepuav {
namespace {

const Sim3 kMoved(3.5, RotationExp({0.7, -1.1, 2.0}), {10, -20, 30});

Trajectory Shifted(const Trajectory& trajectory, const Eigen::Vector3d& shift) {
  return MoveTrajectory(Sim3(1, Eigen::Quaterniond::Identity(), shift), trajectory);
}

TEST(AbsoluteError, AlignmentUndoesAKnownSimilarity) {
  const Trajectory truth = MakeFlight(200, 20);
  const Trajectory estimate = MoveTrajectory(kMoved.Inverse(), truth);
  const AbsoluteError error = ComputeAbsoluteError(truth, estimate, AlignmentKind::kSimilar);
  EXPECT_LT(error.statistics_m.max, 1e-9);
  EXPECT_NEAR(error.truth_from_estimate.scale(), 3.5, 1e-9);
  EXPECT_LT(error.truth_from_estimate.rotation().angularDistance(kMoved.rotation()), 1e-9);
  EXPECT_LT((error.truth_from_estimate.translation() - kMoved.translation()).norm(), 1e-8);

  // With its scale wrong, a rigid alignment cannot fit it: what is left is the spread of the truth
  // less that of the estimate, at least.
  const AbsoluteError rigid = ComputeAbsoluteError(truth, estimate, AlignmentKind::kRigid);
  EXPECT_GT(rigid.statistics_m.rmse, 1);
  EXPECT_EQ(rigid.truth_from_estimate.scale(), 1);
}

TEST(AbsoluteError, RigidAndYawUndoWhatTheyCover) {
  const Trajectory truth = MakeFlight(200, 20);
  const SE3 turned(RotationExp({0.5, 0.2, -2}), {1, 2, 3});
  const SE3 yawed(RotationExp({0, 0, 2.5}), {1, 2, 3});
  const Trajectory by_turn = MoveTrajectory(Sim3(turned), truth);
  const Trajectory by_yaw = MoveTrajectory(Sim3(yawed), truth);
  EXPECT_LT(ComputeAbsoluteError(truth, by_turn, AlignmentKind::kRigid).statistics_m.max, 1e-9);
  EXPECT_LT(ComputeAbsoluteError(truth, by_yaw, AlignmentKind::kYaw).statistics_m.max, 1e-9);
  EXPECT_GT(ComputeAbsoluteError(truth, by_turn, AlignmentKind::kYaw).statistics_m.rmse, 0.1);
}

TEST(AbsoluteError, NoiseComesOutAtItsSize) {
  const Trajectory truth = MakeFlight(2000, 20);
  Random random(11);
  const Trajectory estimate = MoveTrajectory(kMoved.Inverse(), AddNoise(truth, 0.05, random));
  const AbsoluteError error = ComputeAbsoluteError(truth, estimate, AlignmentKind::kSimilar);
  EXPECT_NEAR(error.statistics_m.rmse, 0.05 * std::sqrt(3.0), 0.003);
  EXPECT_NEAR(error.truth_from_estimate.scale(), 3.5, 0.01);
}

TEST(AbsoluteError, WithoutAlignmentAKnownShiftIsTheError) {
  const Trajectory truth = MakeFlight(50, 20);
  const AbsoluteError error = ComputeAbsoluteError(truth, Shifted(truth, {3, 4, 12}), std::nullopt);
  EXPECT_NEAR(error.statistics_m.rmse, 13, 1e-9);
  EXPECT_NEAR(error.statistics_m.std, 0, 1e-9);
  EXPECT_EQ(error.errors_m.size(), 50u);
  EXPECT_LT((error.rms_along_axes_m - Eigen::Vector3d(3, 4, 12)).norm(), 1e-9);
}

TEST(AbsoluteError, ItsPartsAlongTheTruthsAxesAddUp) {
  const Trajectory truth = MakeFlight(2000, 20);
  Trajectory estimate = truth;
  Random random(12);
  for (TimedPose& pose : estimate) {
    const Eigen::Vector3d noise(random.Gaussian(0.05), random.Gaussian(0.1), random.Gaussian(0.4));
    pose.world_from_cam =
        SE3(pose.world_from_cam.rotation(), pose.world_from_cam.translation() + noise);
  }
  const AbsoluteError error = ComputeAbsoluteError(
      truth, MoveTrajectory(kMoved.Inverse(), estimate), AlignmentKind::kSimilar);
  EXPECT_NEAR(error.rms_along_axes_m.x(), 0.05, 0.01);
  EXPECT_NEAR(error.rms_along_axes_m.y(), 0.1, 0.01);
  EXPECT_NEAR(error.rms_along_axes_m.z(), 0.4, 0.03);
  EXPECT_NEAR(error.rms_along_axes_m.norm(), error.statistics_m.rmse, 1e-9);
}

TEST(AbsoluteError, HorizontalLeavesHeightOut) {
  const Trajectory truth = MakeFlight(50, 20);
  const AbsoluteError error =
      ComputeAbsoluteError(truth, Shifted(truth, {3, 4, 12}), std::nullopt, true);
  EXPECT_NEAR(error.statistics_m.rmse, 5, 1e-9);
  EXPECT_LT((error.rms_along_axes_m - Eigen::Vector3d(3, 4, 0)).norm(), 1e-9);
}

TEST(AbsoluteError, HorizontalOverFlatTruthJudgesAPathInAnyWorld) {
  Trajectory truth = MakeFlight(200, 20);
  for (TimedPose& pose : truth) {
    const Eigen::Vector3d position = pose.world_from_cam.translation();
    pose.world_from_cam = SE3(Eigen::Quaterniond::Identity(), {position.x(), position.y(), 0});
  }
  const Trajectory estimate = MoveTrajectory(kMoved.Inverse(), truth);
  EXPECT_LT(ComputeAbsoluteError(truth, estimate, AlignmentKind::kSimilar, true).statistics_m.max,
            1e-9);
}

TEST(AbsoluteError, OrientationsAreMovedToo) {
  const Trajectory truth = MakeFlight(20, 20);
  const Trajectory back = MoveTrajectory(kMoved, MoveTrajectory(kMoved.Inverse(), truth));
  for (size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LT((back[i].world_from_cam * truth[i].world_from_cam.Inverse()).Log().norm(), 1e-9);
    EXPECT_EQ(back[i].time, truth[i].time);
  }
}

TEST(AbsoluteError, TooFewOrCollinearPosesAreErrors) {
  const auto error_of = [](const Trajectory& poses) -> std::string {
    try {
      ComputeAbsoluteError(poses, poses, AlignmentKind::kSimilar);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(error_of(MakeFlight(2, 20)), testing::HasSubstr("2 associated poses are too few"));
  Trajectory line;
  for (int i = 0; i < 20; ++i) {
    line.push_back({AtSeconds(i), SE3(Eigen::Quaterniond::Identity(), {1.0 * i, 2.0 * i, 0})});
  }
  EXPECT_THAT(error_of(line), testing::HasSubstr("on one line"));
  EXPECT_EQ(error_of(MakeFlight(30, 2)), "");

  EXPECT_NO_THROW(ComputeAbsoluteError(line, line, std::nullopt));
  EXPECT_THROW(ComputeAbsoluteError({}, {}, std::nullopt), Error);
  EXPECT_THROW(ComputeAbsoluteError(line, {}, std::nullopt), Error);
}

}  // namespace
}  // namespace deepuav
