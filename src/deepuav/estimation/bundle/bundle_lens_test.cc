// What bundle adjustment makes of the lens and the shutter.

#include <gtest/gtest.h>

#include "deepuav/estimation/bundle/bundle_camera.h"
#include "deepuav/estimation/testing/bundle_worlds.h"

namespace deepuav {
namespace {

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

/// As a drone that hovers and turns sees it.
TEST(EstimateCalibrationSigmas, StandLandmarksWithoutParallaxBesideThoseThatTell) {
  SyntheticWorld world = OrbitWorld(21, 8, 150);
  const SE3 hover = world.cam_from_world.front();
  Random random(23);
  for (int i = 1; i <= 30; ++i) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.01 * i, Eigen::Vector3d::UnitY()));
    const Eigen::Vector3d sway = 1e-3 * RandomDirection(&random);
    world.cam_from_world.push_back(SE3(turn, sway) * hover);
  }
  BundleProblem problem = MakeBundleProblem(world, {0.5, 0}, &random);
  // Most landmarks are seen by those alone that stand and turn.
  std::erase_if(problem.observations, [](const BundleObservation& observation) {
    return observation.landmark % 5 != 0 && observation.camera < 8;
  });
  BundleOptions options = Precise();
  options.refine_focal = options.refine_radial = true;
  options.focal_sigma = options.k1_sigma = options.k2_sigma = 10;
  AdjustBundle(&problem, options);
  std::fill(problem.camera_fixed.begin() + 1, problem.camera_fixed.end(), 0);
  // How far away they are nothing tells.
  const Eigen::Vector3d centre = hover.InverseTranslation();
  for (size_t i = 0; i < problem.landmarks_world.size(); ++i) {
    if (i % 5 == 0) continue;
    Eigen::Vector3d& landmark = problem.landmarks_world[i];
    landmark = centre + 1e4 * (landmark - centre);
  }
  const auto sigmas = EstimateCalibrationSigmas(problem, options);
  ASSERT_TRUE(sigmas);
  EXPECT_GT(sigmas->focal, 1e-4);
  EXPECT_LT(sigmas->focal, 0.02);
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
  problem.radial_guess = {-0.2, 0.05};
  AdjustBundle(&problem, options);
  EXPECT_NEAR(problem.k1, -0.2, 1e-3);
  EXPECT_NEAR(problem.k2, 0.05, 1e-3);
}

}  // namespace
}  // namespace deepuav
