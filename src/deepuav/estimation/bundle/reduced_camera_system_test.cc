#include "deepuav/estimation/bundle/reduced_camera_system.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

#include "deepuav/estimation/testing/small_bundle.h"

namespace deepuav {
namespace {

constexpr RefinedCalibration kAll{true, true, true, true, true}, kNone{};
constexpr HuberLoss kLoss{5.991};
constexpr int kSparse = 1, kDense = 1000;

/// The normal equations as one matrix, put together block by block: cameras, landmarks,
/// calibration.
struct FullSystem {
  FullSystem(const BundleStructure& structure, const BundleLinearisation& blocks)
      : cameras(structure.free_cameras()),
        landmarks(6 * cameras),
        calibration(landmarks + 3 * structure.groups()) {
    const int size = calibration + (blocks.has_calibration ? kCalibrationParameters : 0);
    hessian.setZero(size, size);
    gradient.resize(size);
    for (int i = 0; i < cameras; ++i) {
      Add(6 * i, 6 * i, blocks.camera_camera[i]);
      gradient.segment<6>(6 * i) = blocks.camera_gradient[i];
    }
    for (const CameraPairBlock& pair : blocks.camera_pair)
      Add(6 * pair.row, 6 * pair.column, pair.block);
    for (int g = 0; g < structure.groups(); ++g) {
      Add(landmarks + 3 * g, landmarks + 3 * g, blocks.landmark_landmark[g]);
      gradient.segment<3>(landmarks + 3 * g) = blocks.landmark_gradient[g];
    }
    for (size_t i = 0; i < structure.observations.size(); ++i) {
      const GroupedObservation& o = structure.observations[i];
      if (o.free_camera >= 0)
        Add(6 * o.free_camera, landmarks + 3 * o.group, blocks.camera_landmark[i]);
    }
    if (!blocks.has_calibration) return;
    for (int i = 0; i < cameras; ++i) Add(6 * i, calibration, blocks.camera_calibration[i]);
    for (int g = 0; g < structure.groups(); ++g)
      Add(calibration, landmarks + 3 * g, blocks.calibration_landmark[g]);
    Add(calibration, calibration, blocks.calibration_calibration);
    gradient.tail<kCalibrationParameters>() = blocks.calibration_gradient;
  }

  Eigen::MatrixXd Damped(double damping) const {
    Eigen::MatrixXd damped = hessian;
    damped.diagonal() *= 1 + damping;
    return damped;
  }
  Eigen::VectorXd Step(double damping) const { return -Damped(damping).ldlt().solve(gradient); }
  /// By how much the quadratic model falls: the cost is the sum of squares, not half of it.
  double Decrease(const Eigen::VectorXd& step) const {
    return -2 * gradient.dot(step) - step.dot(hessian * step);
  }

  int cameras, landmarks, calibration;
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;

 private:
  void Add(int row, int column, const Eigen::MatrixXd& block) {
    hessian.block(row, column, block.rows(), block.cols()) += block;
    if (row != column) hessian.block(column, row, block.cols(), block.rows()) += block.transpose();
  }
};

Eigen::VectorXd AsVector(const BundleStep& step, bool has_calibration) {
  std::vector<double> numbers;
  for (const Vector6d& twist : step.camera)
    numbers.insert(numbers.end(), twist.begin(), twist.end());
  for (const Eigen::Vector3d& move : step.landmark)
    numbers.insert(numbers.end(), move.begin(), move.end());
  if (has_calibration)
    numbers.insert(numbers.end(), step.calibration.begin(), step.calibration.end());
  return Eigen::Map<Eigen::VectorXd>(numbers.data(), std::ssize(numbers));
}

/// What other sensors may say of the cameras: pairs that share no landmark, too.
void AddFactors(BundleProblem* problem) {
  const int last = static_cast<int>(problem->cam_from_world.size()) - 1;
  problem->factors.positions.push_back({1, {0.1, 0, 0}, {9, 1, 2}, {3, 3, 3}});
  problem->factors.positions.push_back({last, {0, 0, 0}, {7, -4, 1}, {2, 2, 5}});
  problem->factors.height_steps.push_back({1, last, {0, 0, 0}, {0, 0.2, 0}, 0.3, 4});
  problem->factors.distances.push_back({last, 2, 3.5, 2});
  problem->factors.levels.push_back({2, 20, Eigen::Vector3d::UnitX()});
}

/// A problem at a state away from its minimum.
struct Case {
  Case(BundleProblem made, const RefinedCalibration& refined)
      : problem(std::move(made)), structure(problem) {
    const BundleState state{
        {problem.pinhole, problem.k1, problem.k2, problem.p1, problem.p2, problem.readout_s},
        problem.cam_from_world,
        problem.landmarks_world};
    if (refined.any()) {
      structure.focal_prior = {0.9 * problem.pinhole.fx, 10};
      structure.small_prior = {1, 1, 50, 10};
    }
    blocks.Compute(structure, state, kLoss, refined);
  }

  BundleProblem problem;
  BundleStructure structure;
  BundleLinearisation blocks;
};

/// A flight along a strip: landmarks tie cameras to their neighbours alone.
BundleProblem Strip(int cameras) {
  Random random(4);
  SyntheticWorld world;
  world.landmarks_world = LandmarksOnGround(30 * cameras, {-5, -5}, {3.0 * cameras, 5}, 1, &random);
  for (int i = 0; i < cameras; ++i) world.cam_from_world.push_back(LookDown({3.0 * i, 0, 6}, 0));
  return MakeBundleProblem(world, {1, 0}, &random);
}

std::vector<Case> Cases() {
  std::vector<Case> cases;
  BundleProblem with_factors = SmallProblem().problem;
  AddFactors(&with_factors);
  for (const RefinedCalibration& refined : {kNone, kAll}) {
    cases.emplace_back(SmallProblem().problem, refined);
    cases.emplace_back(with_factors, refined);
  }
  BundleProblem strip = Strip(9);
  AddFactors(&strip);
  cases.emplace_back(strip, kNone);
  return cases;
}

class ReducedSystemTest : public testing::TestWithParam<int> {};

TEST_P(ReducedSystemTest, StepIsThatOfTheFullSystem) {
  for (const Case& c : Cases()) {
    const FullSystem full(c.structure, c.blocks);
    for (const double damping : {1e-4, 0.01, 100.0}) {
      ReducedCameraSystem system(c.structure, GetParam());
      BundleStep step;
      ASSERT_TRUE(system.Solve(c.blocks, damping, &step));
      const Eigen::VectorXd expected = full.Step(damping),
                            found = AsVector(step, c.blocks.has_calibration);
      ASSERT_EQ(found.size(), expected.size());
      EXPECT_LT((found - expected).norm(), 1e-6 * expected.norm()) << damping;
      EXPECT_NEAR(step.predicted_decrease / full.Decrease(expected), 1, 1e-6) << damping;
    }
  }
}

// The least of the damped model is gradient * step below where it begins: with all that moves, and
// with the landmarks alone.
TEST_P(ReducedSystemTest, CameraDecreaseIsWhatLandmarksAloneDoNotGive) {
  for (const Case& c : Cases()) {
    constexpr double kDamping = 0.01;
    const FullSystem full(c.structure, c.blocks);
    const Eigen::MatrixXd damped = full.Damped(kDamping);
    double expected = -full.gradient.dot(full.Step(kDamping));
    for (int at = full.landmarks; at < full.calibration; at += 3) {
      const Eigen::Vector3d gradient = full.gradient.segment<3>(at);
      expected -= gradient.dot(damped.block<3, 3>(at, at).ldlt().solve(gradient));
    }
    ReducedCameraSystem system(c.structure, GetParam());
    BundleStep step;
    ASSERT_TRUE(system.Solve(c.blocks, kDamping, &step));
    EXPECT_NEAR(step.camera_decrease / expected, 1, 1e-6);
  }
}

TEST_P(ReducedSystemTest, KnowsWhatIsKnownOfTheCalibration) {
  const Case c(SmallProblem().problem, kAll);
  constexpr double kDamping = 0.01;
  const FullSystem full(c.structure, c.blocks);
  ReducedCameraSystem system(c.structure, GetParam());
  BundleStep step;
  ASSERT_TRUE(system.Solve(c.blocks, kDamping, &step));
  // The information is the inverse of the covariance's block.
  const Eigen::MatrixXd inverse = full.Damped(kDamping).inverse();
  const MatrixCalibration expected =
      inverse.bottomRightCorner<kCalibrationParameters, kCalibrationParameters>().inverse();
  EXPECT_LT((system.CalibrationInformation() - expected).norm(), 1e-5 * expected.norm());
}

TEST_P(ReducedSystemTest, CovariancesAreBlocksOfTheFullInverse) {
  BundleProblem strip = Strip(12);
  AddFactors(&strip);
  const Case c(strip, kNone);
  constexpr double kDamping = 1e-6;
  const Eigen::MatrixXd inverse = FullSystem(c.structure, c.blocks).Damped(kDamping).inverse();
  ReducedCameraSystem system(c.structure, GetParam());
  BundleStep step;
  ASSERT_TRUE(system.Solve(c.blocks, kDamping, &step));
  const std::vector<Matrix6d> covariances = system.CameraCovariances();
  ASSERT_EQ(covariances.size(), 11u);
  for (size_t i = 0; i < covariances.size(); ++i) {
    const auto at = 6 * static_cast<Eigen::Index>(i);
    const Matrix6d expected = inverse.block<6, 6>(at, at);
    EXPECT_LT((covariances[i] - expected).norm(), 1e-6 * expected.norm()) << i;
  }
}

TEST_P(ReducedSystemTest, WithoutFreeCamerasMovesLandmarksAlone) {
  BundleProblem fixed = SmallProblem().problem;
  fixed.camera_fixed.assign(fixed.camera_fixed.size(), 1);
  const Case c(fixed, kNone);
  ASSERT_EQ(c.structure.free_cameras(), 0);
  ReducedCameraSystem system(c.structure, GetParam());
  BundleStep step;
  ASSERT_TRUE(system.Solve(c.blocks, 0.1, &step));
  const Eigen::VectorXd expected = FullSystem(c.structure, c.blocks).Step(0.1);
  EXPECT_LT((AsVector(step, false) - expected).norm(), 1e-9 * expected.norm());
  EXPECT_EQ(step.camera_decrease, 0);
  EXPECT_TRUE(system.CameraCovariances().empty());
}

TEST_P(ReducedSystemTest, WhatNothingIsKnownOfStaysWhereItIs) {
  Case c(SmallProblem().problem, kNone);
  // A landmark and a camera that tell nothing, as where all their observations are outliers.
  const int group = 3, camera = 1;
  c.blocks.landmark_landmark[group].setZero();
  c.blocks.landmark_gradient[group].setZero();
  c.blocks.camera_camera[camera].setZero();
  c.blocks.camera_gradient[camera].setZero();
  for (size_t i = 0; i < c.structure.observations.size(); ++i) {
    const GroupedObservation& o = c.structure.observations[i];
    if (o.group == group || o.free_camera == camera) c.blocks.camera_landmark[i].setZero();
  }
  ReducedCameraSystem system(c.structure, GetParam());
  BundleStep step;
  ASSERT_TRUE(system.Solve(c.blocks, 1e-3, &step));
  EXPECT_EQ(step.landmark[group].norm(), 0);
  EXPECT_EQ(step.camera[camera].norm(), 0);
  EXPECT_GT(step.camera[0].norm(), 0);
  EXPECT_TRUE(AsVector(step, false).allFinite());
}

TEST_P(ReducedSystemTest, RefusesWhatHasNoMinimumAndSolvesTheNextAgain) {
  const Case good(SmallProblem().problem, kNone);
  ReducedCameraSystem system(good.structure, GetParam());
  BundleStep expected, step;
  ASSERT_TRUE(system.Solve(good.blocks, 0.01, &expected));
  for (const double wrong : {-1e9, std::numeric_limits<double>::quiet_NaN()}) {
    BundleLinearisation blocks = good.blocks;
    blocks.camera_camera[1](2, 2) = wrong;
    EXPECT_FALSE(system.Solve(blocks, 0.01, &step)) << wrong;
  }
  ASSERT_TRUE(system.Solve(good.blocks, 0.01, &step));
  EXPECT_EQ(AsVector(step, false), AsVector(expected, false));
}

TEST_P(ReducedSystemTest, ThreadsChangeNothing) {
  const Case c(Strip(40), kNone);
  BundleStep one, four;
  ASSERT_TRUE(ReducedCameraSystem(c.structure, GetParam(), 1).Solve(c.blocks, 1e-3, &one));
  ASSERT_TRUE(ReducedCameraSystem(c.structure, GetParam(), 4).Solve(c.blocks, 1e-3, &four));
  EXPECT_EQ(AsVector(one, false), AsVector(four, false));
  EXPECT_EQ(one.predicted_decrease, four.predicted_decrease);
}

INSTANTIATE_TEST_SUITE_P(Factorisations, ReducedSystemTest, testing::Values(kSparse, kDense),
                         [](const auto& at) { return at.param == kSparse ? "Sparse" : "Dense"; });

TEST(ReducedCameraSystem, PredictsTheDecreaseOfASmallStep) {
  const SmallProblem small;
  const BundleStructure structure(small.problem);
  const HuberLoss loss{1e9};
  const BundleState state = small.State();
  BundleLinearisation linearisation;
  linearisation.Compute(structure, state, loss, {false, false});
  ReducedCameraSystem system(structure);
  BundleStep step;
  ASSERT_TRUE(
      system.Solve(linearisation, 1e3, &step));  // Heavily damped: the quadratic model holds.
  BundleState moved = state;
  for (int i = 0; i < structure.free_cameras(); ++i) {
    SE3& pose = moved.cam_from_world[structure.camera_of_free[i]];
    pose = SE3::Exp(step.camera[i]) * pose;
  }
  for (int g = 0; g < structure.groups(); ++g) {
    moved.landmarks_world[structure.landmark_of_group[g]] += step.landmark[g];
  }
  const double decrease = BundleCost(structure, state, loss) - BundleCost(structure, moved, loss);
  EXPECT_NEAR(decrease / step.predicted_decrease, 1, 0.01);
}

}  // namespace
}  // namespace deepuav
