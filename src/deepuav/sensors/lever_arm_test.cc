#include "deepuav/sensors/lever_arm.h"

#include <gtest/gtest.h>

#include "support/flights.h"

namespace deepuav {
namespace {

const Eigen::Vector3d kAntenna(0.3, -0.5, 0.2);

/// Whose path is that of the antenna on the camera that flies MakeFlight.
Trajectory AntennaPath() { return MoveToAntenna(Sim3(), MakeFlight(400, 20), kAntenna); }

double SumOfSquares(const Trajectory& truth, const Trajectory& estimate, const Sim3& aligned) {
  const Trajectory moved = MoveToAntenna(aligned, estimate, kAntenna);
  double sum = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    sum += (moved[i].world_from_cam.translation() - truth[i].world_from_cam.translation())
               .squaredNorm();
  }
  return sum;
}

TEST(LeverArm, IsAppliedInTheCamerasAxes) {
  const SE3 pose(RotationExp({0, 0, M_PI / 2}), Eigen::Vector3d(1, 2, 3));
  const Trajectory moved = MoveToAntenna(Sim3(), {{AtSeconds(0), pose}}, {1, 0, 0});
  EXPECT_LT((moved[0].world_from_cam.translation() - Eigen::Vector3d(1, 3, 3)).norm(), 1e-12);
}

TEST(LeverArm, AlignsExactlyWhateverTheEstimatesScale) {
  for (const AlignmentKind kind :
       {AlignmentKind::kSimilar, AlignmentKind::kRigid, AlignmentKind::kYaw}) {
    const double scale = kind == AlignmentKind::kSimilar ? 0.07 : 1;
    const Eigen::Vector3d turn =
        kind == AlignmentKind::kYaw ? Eigen::Vector3d(0, 0, 1.1) : Eigen::Vector3d(0.4, -0.3, 1.1);
    const Sim3 moved(scale, RotationExp(turn), {3, 2, -1});
    const Trajectory estimate = MoveTrajectory(moved, MakeFlight(400, 20));
    const auto aligned = AlignWithLeverArm(AntennaPath(), estimate, kind, kAntenna);
    ASSERT_TRUE(aligned.has_value());
    EXPECT_NEAR(aligned->scale() * scale, 1, 1e-9);
    EXPECT_LT(SumOfSquares(AntennaPath(), estimate, *aligned), 1e-18);
    const auto ignored = Align(Positions(estimate), Positions(AntennaPath()), kind);
    ASSERT_TRUE(ignored.has_value());
    EXPECT_GT(SumOfSquares(AntennaPath(), estimate, *ignored), 1);
  }
}

TEST(LeverArm, WithNoiseItIsTheLeastSumOfSquares) {
  Random random(11);
  const Trajectory truth = AddNoise(AntennaPath(), 0.5, random);
  const Trajectory estimate = MakeFlight(400, 20);
  const auto aligned = AlignWithLeverArm(truth, estimate, AlignmentKind::kSimilar, kAntenna);
  ASSERT_TRUE(aligned.has_value());
  const double least = SumOfSquares(truth, estimate, *aligned);
  for (int i = 0; i < 7; ++i) {
    for (const double step : {-1e-3, 1e-3}) {
      Vector7d change = Vector7d::Zero();
      change[i] = step;
      const Sim3 other(aligned->scale() * (1 + change[6]),
                       RotationExp(change.head<3>()) * aligned->rotation(),
                       aligned->translation() + change.segment<3>(3));
      EXPECT_GT(SumOfSquares(truth, estimate, other), least);
    }
  }
}

TEST(LeverArm, NoneIsUmeyamasAlignment) {
  Random random(12);
  const Trajectory truth = AddNoise(MakeFlight(100, 20), 0.2, random),
                   estimate = MakeFlight(100, 20);
  const auto with = AlignWithLeverArm(truth, estimate, AlignmentKind::kSimilar, {0, 0, 0});
  const auto without = Align(Positions(estimate), Positions(truth), AlignmentKind::kSimilar);
  ASSERT_TRUE(with && without);
  EXPECT_EQ(with->scale(), without->scale());
}

}  // namespace
}  // namespace deepuav
