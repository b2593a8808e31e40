#include <gtest/gtest.h>

#include <limits>

#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "deepuav/estimation/testing/bundle_worlds.h"

namespace deepuav {
namespace {

TEST(SquaredErrors, AreInStandardDeviationsOfEachMeasurement) {
  const SyntheticWorld world = OrbitWorld(1, 3, 40);
  Random random(2);
  BundleProblem problem = MakeBundleProblem(world, {}, &random);
  for (const double error : SquaredErrors(problem)) EXPECT_LT(error, 1e-9);
  problem.observations[0].px += Eigen::Vector2d(3, 0);
  problem.observations[1].px += Eigen::Vector2d(3, 0);
  problem.observations[1].noise = PixelNoise(0.5);
  problem.observations[2].px += Eigen::Vector2d(3, 4);
  problem.observations[2].noise = PixelNoise(Eigen::Matrix2d(Eigen::Vector2d(9, 1).asDiagonal()));
  const std::vector<double> errors = SquaredErrors(problem);
  EXPECT_NEAR(errors[0], 9, 1e-6);
  EXPECT_NEAR(errors[1], 36, 1e-6);
  EXPECT_NEAR(errors[2], 1 + 16, 1e-6);
  for (size_t i = 3; i < errors.size(); ++i) EXPECT_LT(errors[i], 1e-9);

  const BundleObservation& seen = problem.observations[3];
  Eigen::Vector3d& landmark = problem.landmarks_world[static_cast<size_t>(seen.landmark)];
  const SE3& cam_from_world = problem.cam_from_world[static_cast<size_t>(seen.camera)];
  landmark = cam_from_world.Inverse() * Eigen::Vector3d(-(cam_from_world * landmark));
  EXPECT_EQ(SquaredErrors(problem)[3], std::numeric_limits<double>::infinity());
}

TEST(SquaredErrors, SayWhatAnAdjustmentCallsOutliers) {
  const SyntheticWorld world = OrbitWorld(3, 10, 400);
  Random random(4);
  BundleProblem problem = MakeBundleProblem(world, {1, 0.05}, &random);
  problem.camera_fixed[9] = 1;
  const BundleReport report = AdjustBundle(&problem, Precise());
  const std::vector<double> errors = SquaredErrors(problem);
  ASSERT_EQ(errors.size(), report.outlier.size());
  for (size_t i = 0; i < errors.size(); ++i)
    EXPECT_EQ(errors[i] > Precise().chi_square, report.outlier[i] != 0) << i;
}

}  // namespace
}  // namespace deepuav
