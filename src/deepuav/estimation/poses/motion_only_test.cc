#include "deepuav/estimation/poses/motion_only.h"

#include <gtest/gtest.h>

#include <limits>

#include "deepuav/base/error.h"
#include "support/estimation_problems.h"
#include "support/numeric_jacobian.h"

namespace deepuav {
namespace {

/// Of any direction.
PixelNoise RandomNoise(Random* random) {
  PixelNoise noise;
  noise.xx = static_cast<float>(random->Uniform(0.3, 4));
  noise.yy = static_cast<float>(random->Uniform(0.3, 4));
  noise.xy = static_cast<float>(random->Uniform(-0.25, 0.25));
  return noise;
}

SyntheticWorld BoxWorld(uint64_t seed, int landmarks) {
  Random random(seed);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(landmarks, {-6, -4, 4}, {6, 4, 15}, &random);
  return world;
}

double RotationError(const SE3& a, const SE3& b) { return (a * b.Inverse()).Angle(); }
double CentreError(const SE3& a, const SE3& b) {
  return (a.InverseTranslation() - b.InverseTranslation()).norm();
}

TEST(OptimisePose, FindsTheExactPoseWithoutNoise) {
  const SyntheticWorld world = BoxWorld(1, 300);
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    const SE3 truth = Perturbed(SE3(), 0.5, 0.1, &random);
    const auto observations = ObservePose(world, truth, {}, &random);
    const MotionOnlyResult result =
        OptimisePose(world.pinhole, observations, Perturbed(truth, 0.5, 0.1, &random), {});
    EXPECT_LT(RotationError(result.cam_from_world, truth), 1e-9);
    EXPECT_LT(CentreError(result.cam_from_world, truth), 1e-8);
    EXPECT_EQ(result.inlier_count, static_cast<int>(observations.size()));
    EXPECT_LT(result.rms_px, 1e-6);
  }
}

TEST(OptimisePose, SeparatesOutliersUnderNoise) {
  const SyntheticWorld world = BoxWorld(3, 400);
  Random random(4);
  const SE3 truth = Perturbed(SE3(), 0.5, 0.1, &random);
  const auto seen = world.Observe(truth, {1, 0.3}, &random);
  std::vector<PoseObservation> observations;
  for (const auto& s : seen) observations.push_back({world.landmarks_world[s.landmark], s.px, 1});
  const MotionOnlyResult result =
      OptimisePose(world.pinhole, observations, Perturbed(truth, 0.2, 0.03, &random), {});
  EXPECT_LT(RotationError(result.cam_from_world, truth), 1e-3);
  EXPECT_LT(CentreError(result.cam_from_world, truth), 0.02);
  int wrong = 0, good = 0;
  for (size_t i = 0; i < seen.size(); ++i) {
    wrong += seen[i].outlier && result.inlier[i];
    good += !seen[i].outlier && result.inlier[i];
  }
  EXPECT_LE(wrong, 2);
  EXPECT_GT(good, 0.9 * 0.65 * seen.size());
  EXPECT_NEAR(result.rms_px, 1.35, 0.15);  // Two axes of 1 px, the tail beyond chi-square cut off.
}

TEST(OptimisePose, InformationIsTheInverseOfTheScatterOfThePose) {
  const SyntheticWorld world = BoxWorld(5, 200);
  Random random(6);
  Matrix6d scatter = Matrix6d::Zero();
  Matrix6d information = Matrix6d::Zero();
  const int runs = 400;
  MotionOnlyOptions options;
  options.chi_square = 100;  // No inlier is cut, so that the theory holds exactly.
  for (int i = 0; i < runs; ++i) {
    const auto observations = ObservePose(world, SE3(), {1, 0}, &random);
    const MotionOnlyResult result = OptimisePose(world.pinhole, observations, SE3(), options);
    const Vector6d error = result.cam_from_world.Log();
    scatter += error * error.transpose() / runs;
    information += result.information / runs;
  }
  const Matrix6d product = scatter * information;
  EXPECT_NEAR(product.trace(), 6, 0.6);
}

TEST(OptimisePose, InformationEqualsTheNumericJacobian) {
  const SyntheticWorld world = BoxWorld(7, 50);
  Random random(8);
  const SE3 truth = Perturbed(SE3(), 0.3, 0.2, &random);
  auto observations = ObservePose(world, truth, {}, &random);
  for (auto& o : observations) o.noise = RandomNoise(&random);
  const MotionOnlyResult result = OptimisePose(world.pinhole, observations, truth, {});
  Matrix6d expected = Matrix6d::Zero();
  for (const PoseObservation& o : observations) {
    const auto residual = [&](const Eigen::VectorXd& twist) -> Eigen::VectorXd {
      const SE3 pose = SE3::Exp(Vector6d(twist)) * result.cam_from_world;
      const Eigen::Vector2d error = world.pinhole.Project(pose * o.landmark_world) - o.px;
      return Whitening(o.noise) * error;
    };
    const Eigen::MatrixXd jacobian = NumericJacobian(residual, 6);
    expected += jacobian.transpose() * jacobian;
  }
  EXPECT_LT((result.information - expected).norm() / expected.norm(), 1e-7);
}

TEST(OptimisePose, LandmarksBehindTheCameraAreOutliers) {
  const SyntheticWorld world = BoxWorld(9, 200);
  Random random(10);
  auto observations = ObservePose(world, SE3(), {0.5, 0}, &random);
  const size_t behind = observations.size() / 3;
  for (size_t i = 0; i < behind; ++i) observations[i].landmark_world *= -1;  // Same pixel, behind.
  const MotionOnlyResult result =
      OptimisePose(world.pinhole, observations, Perturbed(SE3(), 0.1, 0.02, &random), {});
  EXPECT_LT(CentreError(result.cam_from_world, SE3()), 0.02);
  for (size_t i = 0; i < behind; ++i) EXPECT_FALSE(result.inlier[i]);
}

TEST(OptimisePose, KeepsTheInitialPoseWithFewerThanThreeInliers) {
  const SyntheticWorld world = BoxWorld(11, 200);
  Random random(12);
  auto observations = ObservePose(world, SE3(), {}, &random);
  const SE3 initial = Perturbed(SE3(), 0.1, 0.02, &random);
  observations.resize(2);
  EXPECT_EQ(OptimisePose(world.pinhole, observations, initial, {}).cam_from_world.Matrix(),
            initial.Matrix());
  observations.clear();
  const MotionOnlyResult empty = OptimisePose(world.pinhole, observations, initial, {});
  EXPECT_EQ(empty.cam_from_world.Matrix(), initial.Matrix());
  EXPECT_EQ(empty.inlier_count, 0);
}

TEST(OptimisePose, BadValuesAreOutliersAndNeverSpread) {
  const SyntheticWorld world = BoxWorld(13, 100);
  Random random(14);
  auto observations = ObservePose(world, SE3(), {0.3, 0}, &random);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  observations[0].landmark_world.x() = nan;
  observations[1].px.y() = std::numeric_limits<double>::infinity();
  observations[2].noise = 0;
  observations[3].noise = nan;
  observations[4].landmark_world.setZero();  // In the camera's centre.
  observations[5].px.setConstant(1e200);
  const MotionOnlyResult result = OptimisePose(world.pinhole, observations, SE3(), {});
  EXPECT_LT(CentreError(result.cam_from_world, SE3()), 0.02);
  for (int i = 0; i < 6; ++i) EXPECT_FALSE(result.inlier[i]) << i;

  const SE3 not_a_pose(Eigen::Quaterniond::Identity(), {nan, 0, 0});
  EXPECT_EQ(OptimisePose(world.pinhole, observations, not_a_pose, {}).inlier_count, 0);
  EXPECT_THROW(OptimisePose(Pinhole{0, 450, 1, 1}, observations, SE3(), {}), Error);
  MotionOnlyOptions options;
  options.rounds = 0;
  EXPECT_THROW(OptimisePose(world.pinhole, observations, SE3(), options), Error);
}

TEST(OptimisePose, SameInputGivesTheSameBits) {
  const SyntheticWorld world = BoxWorld(15, 200);
  Random random(16);
  const auto observations = ObservePose(world, SE3(), {1, 0.2}, &random);
  const SE3 initial = Perturbed(SE3(), 0.1, 0.02, &random);
  const MotionOnlyResult a = OptimisePose(world.pinhole, observations, initial, {});
  const MotionOnlyResult b = OptimisePose(world.pinhole, observations, initial, {});
  EXPECT_EQ(a.cam_from_world.Matrix(), b.cam_from_world.Matrix());
  EXPECT_EQ(a.inlier, b.inlier);
}

}  // namespace
}  // namespace deepuav
