#include "deepuav/estimation/bundle/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/estimation/bundle/bundle_camera.h"
#include "deepuav/estimation/testing/bundle_worlds.h"

namespace deepuav {
namespace {

TEST(AdjustBundle, FindsTheTruthWithoutNoise) {
  const SyntheticWorld world = OrbitWorld(1, 8, 200);
  Random random(2);
  BundleProblem problem = MakeBundleProblem(world, {}, &random);
  problem.camera_fixed[7] = 1;  // Scale.
  Disturb(0.2, 0.02, 0.2, &random, &problem);
  const BundleReport report = AdjustBundle(&problem, Precise());
  EXPECT_TRUE(report.converged);
  EXPECT_LT(report.final_cost, 1e-9);
  EXPECT_GT(report.initial_cost, 1e3);
  EXPECT_LT(WorstCentreError(problem, world), 1e-6);
  for (size_t i = 0; i < world.landmarks_world.size(); ++i) {
    EXPECT_LT((problem.landmarks_world[i] - world.landmarks_world[i]).norm(), 1e-5);
  }
  EXPECT_EQ(std::count(report.outlier.begin(), report.outlier.end(), 1), 0);
}

TEST(AdjustBundle, NoiseAndOutliers) {
  const SyntheticWorld world = OrbitWorld(3, 10, 400);
  Random random(4);
  std::vector<uint8_t> outlier;
  BundleProblem problem = MakeBundleProblem(world, {1, 0.05}, &random, &outlier);
  problem.camera_fixed[9] = 1;
  Disturb(0.1, 0.01, 0.1, &random, &problem);
  const BundleReport report = AdjustBundle(&problem, Precise());
  EXPECT_LT(report.final_cost, report.initial_cost);
  EXPECT_LT(WorstCentreError(problem, world), 0.03);
  int found = 0, outliers = 0, wrongly = 0;
  for (size_t i = 0; i < outlier.size(); ++i) {
    outliers += outlier[i];
    found += outlier[i] && report.outlier[i];
    wrongly += !outlier[i] && report.outlier[i];
  }
  EXPECT_GT(found, 0.98 * outliers);
  EXPECT_LT(wrongly, 0.1 * outlier.size());
}

TEST(AdjustBundle, ReachesTheCostThatTheNumberOfFreedomsPredicts) {
  const SyntheticWorld world = OrbitWorld(5, 8, 300);
  Random random(6);
  BundleProblem problem = MakeBundleProblem(world, {1, 0}, &random);
  problem.camera_fixed[7] = 1;
  Disturb(0.1, 0.01, 0.1, &random, &problem);
  BundleOptions options = Precise();
  options.chi_square = 1e6;
  const BundleReport report = AdjustBundle(&problem, options);
  const double freedoms = 2.0 * problem.observations.size() - 6 * 6 - 3 * 300;
  EXPECT_NEAR(report.final_cost / freedoms, 1, 4 * std::sqrt(2 / freedoms));
}

TEST(AdjustBundle, WithoutFixedCamerasTheShapeIsFoundAndTheGaugeHeld) {
  const SyntheticWorld world = OrbitWorld(7, 8, 200);
  Random random(8);
  BundleProblem problem = MakeBundleProblem(world, {}, &random);
  problem.camera_fixed[0] = 0;
  Disturb(0.1, 0.01, 0.1, &random, &problem);
  const BundleReport report = AdjustBundle(&problem, Precise());
  EXPECT_LT(report.final_cost, 1e-6);
  EXPECT_LT(WorstCentreError(problem, world),
            0.5);  // Drifts at most by about what it was disturbed.
}

TEST(AdjustBundle, ThreadsChangeNothing) {
  const SyntheticWorld world = OrbitWorld(21, 30, 1000);
  Random random(22);
  BundleProblem problem = MakeBundleProblem(world, {1, 0.02}, &random);
  ASSERT_GT(problem.observations.size(), 20000) << "in one part";
  problem.camera_fixed[29] = 1;
  Disturb(0.1, 0.01, 0.1, &random, &problem);
  BundleOptions options = Precise();
  options.refine_focal = options.refine_radial = true;
  BundleProblem alone = problem, together = problem;
  const BundleReport one = AdjustBundle(&alone, options);
  options.threads = 3;
  const BundleReport three = AdjustBundle(&together, options);
  EXPECT_EQ(one.final_cost, three.final_cost);
  EXPECT_EQ(alone.pinhole.fx, together.pinhole.fx);
  EXPECT_EQ(alone.k1, together.k1);
  EXPECT_EQ(alone.landmarks_world, together.landmarks_world);
  EXPECT_LT(WorstCentreError(alone, world), 0.03);
}

/// Points whose matches are wrong move on long after the cameras stand still.
TEST(AdjustBundle, StopsWhenCamerasStandStill) {
  const SyntheticWorld world = OrbitWorld(23, 12, 400);
  Random random(24);
  BundleProblem problem = MakeBundleProblem(world, {1, 0.1}, &random);
  problem.camera_fixed[11] = 1;
  Disturb(0.1, 0.01, 0.1, &random, &problem);
  BundleOptions options = Precise();
  BundleProblem to_the_end = problem, still = problem;
  const BundleReport all = AdjustBundle(&to_the_end, options);
  options.min_relative_decrease = 1e-3;
  options.max_last_move = 1e-4;
  const BundleReport less = AdjustBundle(&still, options);
  EXPECT_TRUE(less.converged);
  EXPECT_LT(less.iterations, all.iterations);
  for (size_t i = 0; i < still.cam_from_world.size(); ++i) {
    EXPECT_LT((still.cam_from_world[i].InverseTranslation() -
               to_the_end.cam_from_world[i].InverseTranslation())
                  .norm(),
              1e-3);
  }
}

TEST(AdjustBundle, FixedCamerasStay) {
  const SyntheticWorld world = OrbitWorld(9, 6, 150);
  Random random(10);
  BundleProblem problem = MakeBundleProblem(world, {1, 0}, &random);
  problem.camera_fixed = {1, 0, 1, 0, 1, 0};
  Disturb(0.1, 0.01, 0.1, &random, &problem);
  const BundleProblem before = problem;
  AdjustBundle(&problem, Precise());
  for (size_t i = 0; i < 6; ++i) {
    const bool same = problem.cam_from_world[i].Matrix() == before.cam_from_world[i].Matrix();
    EXPECT_EQ(same, problem.camera_fixed[i] == 1) << i;
  }
  problem.camera_fixed.assign(6, 1);  // Landmarks alone.
  Disturb(0, 0, 0.3, &random, &problem);
  const BundleReport report = AdjustBundle(&problem, Precise());
  EXPECT_TRUE(report.converged);
  EXPECT_LT(report.final_cost, 0.1 * report.initial_cost);
}

TEST(AdjustBundle, WhatIsNotDeterminedStays) {
  const SyntheticWorld world = OrbitWorld(11, 6, 150);
  Random random(12);
  BundleProblem problem = MakeBundleProblem(world, {1, 0}, &random);
  problem.camera_fixed[5] = 1;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  // Landmark 0 seen once, 1 never, 2 not finite; camera 3 sees nothing; some pixels and sigmas are
  // no numbers.
  std::vector<BundleObservation> kept;
  bool first = true;
  for (const BundleObservation& o : problem.observations) {
    if (o.camera == 3 || o.landmark == 1 || (o.landmark == 0 && !first)) continue;
    if (o.landmark == 0) first = false;
    kept.push_back(o);
  }
  problem.observations = kept;
  problem.observations[10].px.x() = nan;
  problem.observations[20].noise = 0;
  problem.observations[30].noise.xx = -1;
  Disturb(0.05, 0.005, 0.05, &random, &problem);
  problem.landmarks_world[2].y() = nan;
  const BundleProblem before = problem;
  const BundleReport report = AdjustBundle(&problem, Precise());
  EXPECT_LT(report.final_cost, report.initial_cost);
  EXPECT_EQ(problem.landmarks_world[0], before.landmarks_world[0]);
  EXPECT_EQ(problem.landmarks_world[1], before.landmarks_world[1]);
  EXPECT_EQ(problem.cam_from_world[3].Matrix(), before.cam_from_world[3].Matrix());
  for (size_t i : {10, 20, 30}) EXPECT_TRUE(report.outlier[i]);
  for (size_t i = 3; i < problem.landmarks_world.size(); ++i)
    EXPECT_TRUE(problem.landmarks_world[i].allFinite());
  for (const SE3& pose : problem.cam_from_world) EXPECT_TRUE(pose.Matrix().allFinite());
}

TEST(AdjustBundle, LandmarksBehindCamerasDoNotSpoilTheRest) {
  const SyntheticWorld world = OrbitWorld(13, 8, 300);
  Random random(14);
  BundleProblem problem = MakeBundleProblem(world, {0.5, 0}, &random);
  problem.camera_fixed[7] = 1;
  Disturb(0.1, 0.01, 0.1, &random, &problem);
  for (int i = 0; i < 15; ++i)
    problem.landmarks_world[i] = 40 * RandomDirection(&random);  // Behind some or all.
  problem.landmarks_world[15] = problem.cam_from_world[3].InverseTranslation();
  BundleOptions options = Precise();
  options.max_iterations =
      150;  // The landmarks come from three times as far as the cameras are apart.
  const BundleReport report = AdjustBundle(&problem, options);
  EXPECT_TRUE(std::isfinite(report.final_cost));
  EXPECT_LT(WorstCentreError(problem, world), 0.05);
  for (const auto& point : problem.landmarks_world) EXPECT_TRUE(point.allFinite());
}

TEST(AdjustBundle, WrongMatchesNearACameraDoNotStopTheRest) {
  // Two views leave the depth of a wrong match free along its ray, up to the camera: the others
  // must still move.
  const SyntheticWorld world = OrbitWorld(15, 2, 300);
  Random random(16);
  BundleProblem problem = MakeBundleProblem(world, {0.5, 0}, &random);
  Disturb(0.05, 0.01, 0.02, &random, &problem);
  for (int i = 0; i < 3; ++i) {
    problem.landmarks_world[i] =
        problem.cam_from_world[1].Inverse() * Eigen::Vector3d(0.001 * i, 0.001, 0.02 + 0.01 * i);
  }
  const BundleReport report = AdjustBundle(&problem, Precise());
  const SE3 truth = world.cam_from_world[1];
  EXPECT_LT((problem.cam_from_world[1] * truth.Inverse()).Angle(), 0.02);
  int outliers = 0;
  for (size_t i = 0; i < problem.observations.size(); ++i) {
    outliers += report.outlier[i] && problem.observations[i].landmark >= 3;
  }
  EXPECT_LT(outliers, 0.01 * problem.observations.size());
}

TEST(AdjustBundle, SameInputGivesTheSameBits) {
  const SyntheticWorld world = OrbitWorld(21, 8, 200);
  Random random(22);
  BundleProblem a = MakeBundleProblem(world, {1, 0.1}, &random);
  Disturb(0.1, 0.01, 0.1, &random, &a);
  BundleProblem b = a;
  EXPECT_EQ(AdjustBundle(&a, {}).final_cost, AdjustBundle(&b, {}).final_cost);
  for (size_t i = 0; i < 8; ++i)
    EXPECT_EQ(a.cam_from_world[i].Matrix(), b.cam_from_world[i].Matrix());
  EXPECT_EQ(a.landmarks_world, b.landmarks_world);
}

TEST(AdjustBundle, StopsBetweenStepsAndKeepsWhatItHas) {
  const SyntheticWorld world = OrbitWorld(23, 8, 200);
  Random random(24);
  BundleProblem problem = MakeBundleProblem(world, {1, 0}, &random);
  Disturb(0.1, 0.01, 0.1, &random, &problem);
  int asked = 0;
  const BundleReport report = AdjustBundle(&problem, {}, [&] { return ++asked > 2; });
  EXPECT_EQ(report.iterations, 2);
  EXPECT_FALSE(report.converged);
  EXPECT_LT(report.final_cost, report.initial_cost);
  EXPECT_EQ(report.outlier.size(), problem.observations.size());
}

TEST(AdjustBundle, EmptyAndWrongProblems) {
  BundleProblem empty;
  empty.pinhole = {450, 450, 376, 240};
  EXPECT_TRUE(AdjustBundle(&empty, {}).converged);

  const SyntheticWorld world = OrbitWorld(25, 3, 50);
  Random random(26);
  const BundleProblem good = MakeBundleProblem(world, {}, &random);
  BundleProblem bad = good;
  bad.observations[3].camera = 3;
  EXPECT_THROW(AdjustBundle(&bad, {}), Error);
  bad = good;
  bad.observations[3].landmark = -1;
  EXPECT_THROW(AdjustBundle(&bad, {}), Error);
  bad = good;
  bad.camera_fixed.pop_back();
  EXPECT_THROW(AdjustBundle(&bad, {}), Error);
  bad = good;
  bad.pinhole.fx = 0;
  EXPECT_THROW(AdjustBundle(&bad, {}), Error);
  bad = good;
  bad.cam_from_world[1] =
      SE3(Eigen::Quaterniond::Identity(), {std::numeric_limits<double>::infinity(), 0, 0});
  EXPECT_THROW(AdjustBundle(&bad, {}), Error);
  bad = good;
  BundleOptions options;
  options.chi_square = -1;
  EXPECT_THROW(AdjustBundle(&bad, options), Error);
}

}  // namespace
}  // namespace deepuav
