#include "deepuav/estimation/poses/turning_pose.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/numeric_jacobian.h"
#include "support/synthetic_world.h"

namespace deepuav {
namespace {

constexpr int kHeight = 480;

SyntheticWorld BoxWorld(uint64_t seed, int landmarks) {
  Random random(seed);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(landmarks, {-6, -4, 4}, {6, 4, 15}, &random);
  return world;
}

double Error(const SE3& a, const SE3& b) {
  return (a * b.Inverse()).Angle() + (a.InverseTranslation() - b.InverseTranslation()).norm();
}

/// What a camera sees that turns so while it reads the image: each row is another camera.
std::vector<RowObservation> SeenByRows(const SyntheticWorld& world, const SE3& cam_from_world,
                                       const ReadoutMotion& motion, const SyntheticNoise& noise,
                                       Random* random) {
  std::vector<RowObservation> rows;
  for (const SyntheticObservation& seen : world.Observe(cam_from_world, noise, random)) {
    const Eigen::Vector3d& landmark = world.landmarks_world[static_cast<size_t>(seen.landmark)];
    const Eigen::Vector2d off = seen.px - world.pinhole.Project(cam_from_world * landmark);
    Eigen::Vector2d px = seen.px;
    for (int round = 0; round < 5; ++round) {
      const Eigen::Vector3d turn = motion.TurnAt(RowMoment(px.y(), kHeight));
      const SE3 row_from_cam(RotationExp(-turn), Eigen::Vector3d::Zero());
      px = world.pinhole.Project(row_from_cam * (cam_from_world * landmark)) + off;
    }
    rows.push_back(
        {{landmark, px, {noise.sigma_px > 0 ? noise.sigma_px : 1}}, RowMoment(px.y(), kHeight)});
  }
  return rows;
}

ReadoutMotion Turning(const Eigen::Vector3d& turn_rad,
                      const Eigen::Vector3d& bend_rad = {0, 0, 0}) {
  ReadoutMotion motion;
  motion.turn_rad = turn_rad;
  motion.bend_rad = bend_rad;
  return motion;
}

TEST(TurningPose, FindsHowTheCameraTurned) {
  const SyntheticWorld world = BoxWorld(1, 300);
  Random random(2);
  const ReadoutMotion motion = Turning({0.004, -0.003, 0.005});
  const SE3 truth = Perturbed(SE3(), 0.5, 0.1, &random);
  const auto rows = SeenByRows(world, truth, motion, {}, &random);
  const SE3 initial = Perturbed(truth, 0.1, 0.02, &random);
  const auto found = OptimiseTurningPose(world.pinhole, rows, initial, TurnModel::kTurn, {});
  ASSERT_TRUE(found);
  // What is left is of second order in the turn, and what the prior takes off.
  EXPECT_LT((found->turn_rad - motion.turn_rad).norm(), 5e-5);
  EXPECT_TRUE(found->bend_rad.isZero(0));
  EXPECT_LT(Error(found->cam_from_world, truth), 1e-4);
  const auto still = OptimiseTurningPose(world.pinhole, rows, initial, TurnModel::kNone, {});
  ASSERT_TRUE(still);
  EXPECT_TRUE(still->turn_rad.isZero(0));
  EXPECT_LT(found->cost, 1e-3 * still->cost);
}

TEST(TurningPose, FindsATurnThatBends) {
  const SyntheticWorld world = BoxWorld(3, 400);
  Random random(4);
  const ReadoutMotion motion = Turning({0.002, 0.004, -0.003}, {-0.003, 0.001, 0.002});
  const auto rows = SeenByRows(world, SE3(), motion, {}, &random);
  const auto found = OptimiseTurningPose(world.pinhole, rows, SE3(), TurnModel::kTurnAndBend, {});
  ASSERT_TRUE(found);
  EXPECT_LT((found->turn_rad - motion.turn_rad).norm(), 1e-4);
  EXPECT_LT((found->bend_rad - motion.bend_rad).norm(), 3e-4);
  EXPECT_LT(Error(found->cam_from_world, SE3()), 2e-4);
}

TEST(TurningPose, KnowsItToAMilliradianUnderNoiseAndOutliers) {
  const SyntheticWorld world = BoxWorld(5, 400);
  Random random(6);
  double squared = 0, variance = 0;
  constexpr int kImages = 30;
  for (int i = 0; i < kImages; ++i) {
    const ReadoutMotion motion =
        Turning({random.Gaussian(0.006), random.Gaussian(0.006), random.Gaussian(0.006)});
    const SE3 truth = Perturbed(SE3(), 0.5, 0.1, &random);
    const auto rows = SeenByRows(world, truth, motion, {0.2, 0.2}, &random);
    const auto found = OptimiseTurningPose(
        world.pinhole, rows, Perturbed(truth, 0.05, 0.01, &random), TurnModel::kTurn, {});
    ASSERT_TRUE(found);
    squared += (found->turn_rad - motion.turn_rad).squaredNorm();
    variance += 3 * found->turn_sigma_rad * found->turn_sigma_rad;
  }
  EXPECT_LT(std::sqrt(squared / kImages), 1e-3);
  EXPECT_GT(std::sqrt(variance / squared), 0.8);
  EXPECT_LT(std::sqrt(variance / squared), 3) << "outliers count as noise";
}

TEST(TurningPose, TurnsBySmallNumbersWhereTheCameraDidNot) {
  const SyntheticWorld world = BoxWorld(7, 400);
  Random random(8);
  const auto rows = SeenByRows(world, SE3(), {}, {0.2, 0}, &random);
  const auto found = OptimiseTurningPose(world.pinhole, rows, SE3(), TurnModel::kTurnAndBend, {});
  const auto still = OptimiseTurningPose(world.pinhole, rows, SE3(), TurnModel::kNone, {});
  ASSERT_TRUE(found && still);
  EXPECT_LT(found->turn_rad.norm(), 1e-3);
  EXPECT_LT(found->bend_rad.norm(), 4e-3);
  EXPECT_LE(found->cost, still->cost);
  EXPECT_GT(found->cost, 0.95 * still->cost);
}

/// On a plane far away, in a narrow view, turning about its x axis is a tilt of the plane.
TEST(TurningPose, StaysWithinWhatCamerasDoWhereTheViewDoesNotTell) {
  Random random(9);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(200, {-0.5, -0.5, 20}, {0.5, 0.5, 20.001}, &random);
  const TurningPoseOptions options;
  const auto rows = SeenByRows(world, SE3(), {}, {0.5, 0}, &random);
  const auto found =
      OptimiseTurningPose(world.pinhole, rows, SE3(), TurnModel::kTurnAndBend, options);
  ASSERT_TRUE(found);
  EXPECT_LT(found->turn_rad.cwiseAbs().maxCoeff(), 3 * options.turn_sigma_rad);
  EXPECT_LT(found->bend_rad.cwiseAbs().maxCoeff(), 3 * options.bend_sigma_rad);
}

TEST(TurningPose, NeedsObservationsThatCanBeUsed) {
  const SyntheticWorld world = BoxWorld(10, 200);
  Random random(11);
  auto rows = SeenByRows(world, SE3(), {}, {}, &random);
  TurningPoseOptions options;
  options.min_observations = static_cast<int>(rows.size());
  EXPECT_TRUE(OptimiseTurningPose(world.pinhole, rows, SE3(), TurnModel::kTurn, options));
  rows[0].seen.px.x() = NAN;
  EXPECT_FALSE(OptimiseTurningPose(world.pinhole, rows, SE3(), TurnModel::kTurn, options));
  EXPECT_FALSE(OptimiseTurningPose(world.pinhole, {}, SE3(), TurnModel::kTurn, {}));
}

TEST(TurningPose, IsNotMisledByPointsBehindTheCamera) {
  const SyntheticWorld world = BoxWorld(12, 300);
  Random random(13);
  const ReadoutMotion motion = Turning({0.003, 0.003, 0});
  auto rows = SeenByRows(world, SE3(), motion, {}, &random);
  for (size_t i = 0; i < rows.size(); i += 10) rows[i].seen.landmark_world.z() *= -1;
  const auto found = OptimiseTurningPose(world.pinhole, rows, SE3(), TurnModel::kTurn, {});
  ASSERT_TRUE(found);
  EXPECT_LT((found->turn_rad - motion.turn_rad).norm(), 1e-4);
}

TEST(TurningPose, JacobianOfATurnIsThatOfTheRow) {
  const Pinhole pinhole{450, 455, 320, 240};
  const Eigen::Vector3d point(1.2, -0.8, 6);
  const Matrix26d pose = PoseJacobian(pinhole.ProjectJacobian(point), point);
  constexpr double kMoment = 0.4;
  const Eigen::MatrixXd numeric = NumericJacobian(
      [&](const Eigen::VectorXd& turn) -> Eigen::VectorXd {
        return FromMiddleRow(pinhole, pinhole.Project(point), kMoment, Turning(turn));
      },
      3);
  EXPECT_LT((numeric - TurnJacobian(pose, kMoment)).norm(), 1e-5 * numeric.norm());
}

}  // namespace
}  // namespace deepuav
