// What a bundle problem tells of its cameras.

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/estimation/bundle/bundle_linearisation.h"
#include "deepuav/estimation/bundle/reduced_camera_system.h"
#include "deepuav/estimation/testing/bundle_worlds.h"

namespace deepuav {
namespace {

constexpr int kCameras = 8;

/// With the distance of two cameras exact: scale is no matter of noise.
BundleProblem Problem(const SyntheticWorld& world, double sigma_px, uint64_t seed) {
  Random random(seed);
  BundleProblem problem = MakeBundleProblem(world, {sigma_px, 0}, &random);
  const double distance =
      (world.cam_from_world[0].InverseTranslation() - world.cam_from_world[5].InverseTranslation())
          .norm();
  problem.factors.distances.push_back({0, 5, distance, 1e5 / distance});
  return problem;
}

TEST(EstimateCameraCovariances, AreThoseOfRepeatedAdjustments) {
  const SyntheticWorld world = OrbitWorld(31, kCameras, 150);
  double mean = 0;
  constexpr int kRuns = 40;
  for (int run = 0; run < kRuns; ++run) {
    // Twice the noise that is stated: the residuals show it.
    BundleProblem problem = Problem(world, 2, 200 + static_cast<uint64_t>(run));
    BundleOptions options = Precise();
    options.chi_square = 100;
    AdjustBundle(&problem, options);
    const auto covariances = EstimateCameraCovariances(problem, options);
    ASSERT_TRUE(covariances);
    EXPECT_TRUE((*covariances)[0].isZero());  // It is held.
    for (size_t i = 1; i < kCameras; ++i) {
      const Vector6d error = (world.cam_from_world[i] * problem.cam_from_world[i].Inverse()).Log();
      mean += error.dot((*covariances)[i].ldlt().solve(error)) / (6.0 * (kCameras - 1) * kRuns);
    }
  }
  EXPECT_NEAR(mean, 1, 0.2);
}

TEST(EstimateCameraCovariances, AreTheSameDenseAndSparse) {
  const BundleProblem problem = Problem(OrbitWorld(32, kCameras, 150), 1, 5);
  const BundleStructure structure(problem);
  const BundleState state{{problem.pinhole}, problem.cam_from_world, problem.landmarks_world};
  BundleLinearisation linearisation;
  linearisation.Compute(structure, state, HuberLoss{5.991}, RefinedCalibration{});
  ReducedCameraSystem dense(structure, kCameras + 1), sparse(structure, 0);
  BundleStep step;
  ASSERT_TRUE(dense.Solve(linearisation, 1e-9, &step));
  ASSERT_TRUE(sparse.Solve(linearisation, 1e-9, &step));
  const auto first = dense.CameraCovariances(), second = sparse.CameraCovariances();
  ASSERT_EQ(first.size(), kCameras - 1);
  ASSERT_EQ(second.size(), first.size());
  for (size_t i = 0; i < first.size(); ++i)
    EXPECT_LT((first[i] - second[i]).norm(), 1e-5 * first[i].norm());
}

TEST(EstimateCameraCovariances, AProblemWithoutObservationsTellsNothing) {
  BundleProblem problem = Problem(OrbitWorld(33, kCameras, 50), 1, 5);
  problem.observations.clear();
  EXPECT_FALSE(EstimateCameraCovariances(problem, Precise()));
}

}  // namespace
}  // namespace deepuav
