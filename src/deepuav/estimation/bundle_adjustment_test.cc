#include "deepuav/estimation/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/estimation/bundle_camera.h"
#include "support/estimation_problems.h"

namespace deepuav {
namespace {

SyntheticWorld OrbitWorld(uint64_t seed, int cameras, int landmarks) {
  Random random(seed);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(landmarks, {-5, -5, -3}, {5, 5, 3}, &random);
  world.cam_from_world = OrbitPath(cameras, {0, 0, 0}, 12, 3, 1.5);
  return world;
}

/// Moves all free cameras and all landmarks off the truth.
void Disturb(double camera_translation, double camera_rotation, double landmark, Random* random,
             BundleProblem* problem) {
  for (size_t i = 0; i < problem->cam_from_world.size(); ++i) {
    if (problem->camera_fixed[i]) continue;
    problem->cam_from_world[i] =
        Perturbed(problem->cam_from_world[i], camera_translation, camera_rotation, random);
  }
  for (auto& point : problem->landmarks_world) point += landmark * RandomDirection(random);
}

double WorstCenterError(const BundleProblem& problem, const SyntheticWorld& world) {
  double worst = 0;
  for (size_t i = 0; i < world.cam_from_world.size(); ++i) {
    worst = std::max(worst, (problem.cam_from_world[i].InverseTranslation() -
                             world.cam_from_world[i].InverseTranslation())
                                .norm());
  }
  return worst;
}

BundleOptions Precise() {
  BundleOptions options;
  options.max_iterations = 50;
  options.min_relative_decrease = 1e-9;
  return options;
}

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
  EXPECT_LT(WorstCenterError(problem, world), 1e-6);
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
  EXPECT_LT(WorstCenterError(problem, world), 0.03);
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
  EXPECT_LT(WorstCenterError(problem, world),
            0.5);  // Drifts at most by about what it was disturbed.
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
  EXPECT_LT(WorstCenterError(problem, world), 0.05);
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

TEST(AdjustBundle, RefinesAWrongFocalLengthAndDistortion) {
  const SyntheticWorld world = OrbitWorld(17, 12, 400);
  Random random(18);
  BundleProblem problem = MakeBundleProblem(world, {}, &random);
  const double k1 = -0.08, k2 = 0.02;
  for (BundleObservation& o : problem.observations) {  // Distort the exact pixels, then add noise.
    const Eigen::Vector3d ray = world.pinhole.Unproject(o.px);
    const double squared = ray.head<2>().squaredNorm();
    const double radial = 1 + squared * (k1 + squared * k2);
    o.px = world.pinhole.Project({radial * ray.x(), radial * ray.y(), 1});
    o.px += Eigen::Vector2d(random.Gaussian(0.5), random.Gaussian(0.5));
  }
  problem.pinhole.fx *= 1.05;
  problem.pinhole.fy *= 1.05;
  BundleOptions options = Precise();
  options.max_iterations = 100;
  options.refine_focal = options.refine_radial = true;
  const BundleReport report = AdjustBundle(&problem, options);
  EXPECT_TRUE(report.converged);
  EXPECT_NEAR(problem.pinhole.fx, 450, 1.5);
  EXPECT_DOUBLE_EQ(problem.pinhole.fx, problem.pinhole.fy);
  EXPECT_NEAR(problem.k1, k1, 0.01);
  EXPECT_NEAR(problem.k2, k2, 0.03);
  EXPECT_LT(std::count(report.outlier.begin(), report.outlier.end(), 1),
            0.001 * report.outlier.size());

  // What is not refined stays as given.
  const double focal = problem.pinhole.fx;
  problem.k1 = problem.k2 = 0;
  options.refine_radial = false;
  AdjustBundle(&problem, options);
  EXPECT_EQ(problem.k1, 0);
  EXPECT_NE(problem.pinhole.fx, focal);
}

TEST(AdjustBundle, RefinesAWholeLensAndAShutterThatRolls) {
  const SyntheticWorld world = OrbitWorld(31, 12, 400);
  Random random(32);
  BundleProblem problem = MakeBundleProblem(world, {}, &random);
  const BundleCamera truth{
      {world.pinhole.fx, world.pinhole.fy, world.pinhole.cx + 12, world.pinhole.cy - 7},
      -0.08,
      0.02,
      0.002,
      -0.003,
      0.03};
  for (BundleObservation& o : problem.observations) {
    const Eigen::Vector3d still = world.cam_from_world[static_cast<size_t>(o.camera)] *
                                  world.landmarks_world[static_cast<size_t>(o.landmark)];
    // Each camera moves otherwise, and the row is that of the pixel without it, nearly.
    const Eigen::Vector3d velocity(3.0 * ((o.camera % 3) - 1), 2.0 * ((o.camera % 2) - 0.5), 0.5);
    const double row = truth.Project(still).y() / 480 - 0.5;
    o.drift_cam_per_s = -row * velocity;
    o.px = truth.Project(still + truth.readout_s * o.drift_cam_per_s);
    o.px += Eigen::Vector2d(random.Gaussian(0.1), random.Gaussian(0.1));
    o.noise = 0.1;
  }
  BundleOptions options = Precise();
  options.max_iterations = 100;
  options.refine_focal = options.refine_radial = true;
  options.refine_centre = options.refine_tangential = options.refine_readout = true;
  // The drift is in units of the world: its scale must be told.
  problem.camera_fixed[0] = problem.camera_fixed[5] = 1;
  problem.cam_from_world[0] = world.cam_from_world[0];
  problem.cam_from_world[5] = world.cam_from_world[5];
  AdjustBundle(&problem, options);
  EXPECT_NEAR(problem.pinhole.fx, truth.pinhole.fx, 1);
  EXPECT_NEAR(problem.pinhole.cx, truth.pinhole.cx, 1);
  EXPECT_NEAR(problem.pinhole.cy, truth.pinhole.cy, 1);
  EXPECT_NEAR(problem.p1, truth.p1, 5e-4);
  EXPECT_NEAR(problem.p2, truth.p2, 5e-4);
  EXPECT_NEAR(problem.readout_s, truth.readout_s, 0.003);
  const auto sigmas = EstimateCalibrationSigmas(problem, options);
  ASSERT_TRUE(sigmas);
  EXPECT_LT(std::abs(problem.pinhole.cx - truth.pinhole.cx),
            5 * sigmas->centre * problem.pinhole.fx);
  EXPECT_LT(sigmas->readout_s, 0.003);
  EXPECT_LT(std::abs(problem.readout_s - truth.readout_s), 5 * sigmas->readout_s);
}

TEST(AdjustBundle, RefinesAFocalLengthFivePercentWrong) {
  for (double factor : {0.95, 1.05}) {
    const SyntheticWorld world = OrbitWorld(19, 12, 400);
    Random random(20);
    BundleProblem problem = MakeBundleProblem(world, {0.7, 0.02}, &random);
    problem.pinhole.fx *= factor;
    problem.pinhole.fy *= factor;
    BundleOptions options = Precise();
    options.refine_focal = true;
    AdjustBundle(&problem, options);
    EXPECT_NEAR(problem.pinhole.fx, 450, 1);
    EXPECT_EQ(problem.k1, 0);
  }
}

/// Level flight without turns: focal length and height may grow together.
SyntheticWorld LevelFlight() {
  Random random(27);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(400, {-6, -6, 9}, {14, 6, 11}, &random);
  for (int i = 0; i < 9; ++i)
    world.cam_from_world.emplace_back(Eigen::Quaterniond::Identity(),
                                      Eigen::Vector3d(-i, 0.3 * (i % 3), 0));
  return world;
}

TEST(AdjustBundle, KeepsAFocalLengthThatNothingTells) {
  const SyntheticWorld world = LevelFlight();
  for (const double sigma : {0.001, 0.1}) {
    Random random(28);
    BundleProblem problem = MakeBundleProblem(world, {1, 0}, &random);
    Disturb(0.02, 0.005, 0.02, &random, &problem);
    problem.focal_guess_px = problem.pinhole.fx;
    problem.pinhole.fx *= 1.3;  // As an adjustment without the guess may leave it.
    problem.pinhole.fy *= 1.3;
    BundleOptions options = Precise();
    options.max_iterations = 200;
    options.refine_focal = true;
    options.focal_sigma = sigma;
    AdjustBundle(&problem, options);
    EXPECT_NEAR(problem.pinhole.fx / problem.focal_guess_px, 1, sigma < 0.01 ? 0.002 : 0.1);
    EXPECT_DOUBLE_EQ(problem.pinhole.fx, problem.pinhole.fy);
  }
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

TEST(EstimateCalibrationSigmas, AreThoseOfRepeatedAdjustments) {
  const SyntheticWorld world = OrbitWorld(21, 8, 150);
  BundleOptions options = Precise();
  options.refine_focal = options.refine_radial = true;
  options.focal_sigma = options.k1_sigma = options.k2_sigma = 10;
  double focal_squared = 0, k1_squared = 0;
  CalibrationSigmas sigmas;
  constexpr int kRuns = 40;
  for (int run = 0; run < kRuns; ++run) {
    Random random(100 + static_cast<uint64_t>(run));
    BundleProblem problem = MakeBundleProblem(world, {0.5, 0}, &random);
    AdjustBundle(&problem, options);
    focal_squared += std::pow(std::log(problem.pinhole.fx / world.pinhole.fx), 2);
    k1_squared += problem.k1 * problem.k1;
    const auto estimated = EstimateCalibrationSigmas(problem, options);
    ASSERT_TRUE(estimated);
    sigmas = *estimated;
  }
  EXPECT_NEAR(sigmas.focal / std::sqrt(focal_squared / kRuns), 1, 0.3);
  EXPECT_NEAR(sigmas.k1 / std::sqrt(k1_squared / kRuns), 1, 0.3);
}

TEST(EstimateCalibrationSigmas, OfWhatIsNotRefinedAreNone) {
  Random random(22);
  const BundleProblem problem = MakeBundleProblem(OrbitWorld(21, 4, 50), {0.5, 0}, &random);
  EXPECT_FALSE(EstimateCalibrationSigmas(problem, Precise()));
}

TEST(AdjustBundle, WhatTheViewsDoNotTellOfTheLensStaysWithThePrior) {
  // Two views leave the bend to be traded against the landmarks.
  const SyntheticWorld world = OrbitWorld(23, 2, 60);
  Random random(24);
  BundleProblem problem = MakeBundleProblem(world, {0.5, 0}, &random);
  problem.k1 = 0.3;
  BundleOptions options = Precise();
  options.refine_focal = options.refine_radial = true;
  options.k1_sigma = options.k2_sigma = 1e-4;
  AdjustBundle(&problem, options);
  EXPECT_NEAR(problem.k1, 0, 1e-3);
}

}  // namespace
}  // namespace deepuav
