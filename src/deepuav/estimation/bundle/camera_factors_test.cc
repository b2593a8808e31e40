#include "deepuav/estimation/bundle/camera_factors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/estimation/bundle/bundle_linearisation.h"
#include "deepuav/estimation/bundle/reduced_camera_system.h"
#include "deepuav/geometry/sim3.h"
#include "support/estimation_problems.h"
#include "support/numeric_jacobian.h"

namespace deepuav {
namespace {

const Eigen::Vector3d kCentre = Eigen::Vector3d::Zero();
const SE3 kFirst = SE3::Exp((Vector6d() << 1, -2, 0.5, 0.3, -0.8, 0.4).finished());
const SE3 kSecond = SE3::Exp((Vector6d() << -1, 0.2, 1.5, -0.6, 0.1, 1.4).finished());

SE3 Moved(const SE3& pose, const Eigen::VectorXd& twist) {
  return SE3::Exp(Vector6d(twist)) * pose;
}

TEST(CameraFactors, JacobiansEqualCentralDifferences) {
  const PositionFactor position{0, {0.3, -0.2, 0.1}, {4, 5, 6}, {2, 3, 0.5}};
  Matrix36d of_position;
  PositionError(position, kFirst, &of_position);
  EXPECT_LT((of_position - NumericJacobian(
                               [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
                                 return PositionError(position, Moved(kFirst, d));
                               },
                               6))
                .norm(),
            1e-7);

  const HeightStepFactor step{0, 1, {0.1, 0.2, 0.3}, {-0.4, 0.1, 0.2}, 2, 3};
  Matrix16d of_first, of_second;
  HeightStepError(step, kFirst, kSecond, &of_first, &of_second);
  EXPECT_LT((of_first - NumericJacobian(
                            [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
                              return HeightStepError(step, Moved(kFirst, d), kSecond);
                            },
                            6))
                .norm(),
            1e-7);
  EXPECT_LT((of_second - NumericJacobian(
                             [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
                               return HeightStepError(step, kFirst, Moved(kSecond, d));
                             },
                             6))
                .norm(),
            1e-7);

  const DistanceFactor distance{0, 1, 2, 3};
  DistanceError(distance, kFirst, kSecond, &of_first, &of_second);
  EXPECT_LT((of_first - NumericJacobian(
                            [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
                              return DistanceError(distance, Moved(kFirst, d), kSecond);
                            },
                            6))
                .norm(),
            1e-7);
  EXPECT_LT((of_second - NumericJacobian(
                             [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
                               return DistanceError(distance, kFirst, Moved(kSecond, d));
                             },
                             6))
                .norm(),
            1e-7);

  for (const Eigen::Vector3d& normal_world :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.36, -0.8, 0.48)}) {
    const LevelFactor level{0, 4, Eigen::Vector3d(0.6, 0, -0.8), normal_world};
    Matrix16d of_level;
    LevelError(level, kFirst, &of_level);
    EXPECT_LT((of_level - NumericJacobian(
                              [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
                                return LevelError(level, Moved(kFirst, d));
                              },
                              6))
                  .norm(),
              1e-7);
  }
}

TEST(CameraFactors, SayNothingOfWhatIsTrue) {
  const PositionFactor position{
      0, {0.3, -0.2, 0.1}, kFirst.Inverse() * Eigen::Vector3d(0.3, -0.2, 0.1), {2, 3, 0.5}};
  EXPECT_LT(PositionError(position, kFirst).norm(), 1e-12);
  const SE3 level(RotationExp({-M_PI / 2, 0, 0}), Eigen::Vector3d(1, 2, 3));  // world_from_cam
  EXPECT_NEAR(LevelError({0, 4}, level.Inverse())[0], 0, 1e-12);
  const LevelFactor along_y{.per_sigma = 4, .normal_world = Eigen::Vector3d::UnitX()};
  EXPECT_NEAR(LevelError(along_y, level.Inverse())[0], 4, 1e-12);  // Its x axis is the world's.
  HeightStepFactor step{.second_camera = 1, .per_sigma = 2};
  step.step_world = kSecond.InverseTranslation().z() - kFirst.InverseTranslation().z();
  EXPECT_NEAR(HeightStepError(step, kFirst, kSecond)[0], 0, 1e-12);
  const double apart = (kFirst.InverseTranslation() - kSecond.InverseTranslation()).norm();
  EXPECT_NEAR(DistanceError({0, 1, apart, 2}, kFirst, kSecond)[0], 0, 1e-12);
}

TEST(CameraFactors, CamerasAtOnePlaceHaveADistanceWithoutDirection) {
  Matrix16d of_first, of_second;
  EXPECT_EQ(DistanceError({0, 1, 2, 3}, kFirst, kFirst, &of_first, &of_second)[0], -6);
  EXPECT_EQ(of_first.norm() + of_second.norm(), 0);
}

/// An orbit of cameras that is free to move as a whole.
class FactorProblem : public ::testing::Test {
 protected:
  FactorProblem() {
    world_.landmarks_world = LandmarksInBox(200, {-3, -3, -2}, {3, 3, 2}, &random_);
    world_.cam_from_world = OrbitPath(12, {0, 0, 0}, 10, 2, 2);
    problem_ = MakeBundleProblem(world_, {0.5, 0}, &random_);
    problem_.camera_fixed[0] = 0;
    for (int i = 0; i < 12; ++i) {
      problem_.factors.positions.push_back(
          {i,
           {0.1, 0, 0},
           world_.cam_from_world[static_cast<size_t>(i)].Inverse() * Eigen::Vector3d(0.1, 0, 0),
           Eigen::Vector3d::Constant(10)});
    }
  }
  /// Everything moved, turned and scaled.
  void Disturb(const Sim3& moved) {
    for (SE3& pose : problem_.cam_from_world) pose = moved.MovePose(pose);
    for (Eigen::Vector3d& landmark : problem_.landmarks_world) landmark = moved * landmark;
  }
  double LargestError() const {
    double largest = 0;
    for (size_t i = 0; i < world_.cam_from_world.size(); ++i) {
      largest = std::max(largest, (problem_.cam_from_world[i].InverseTranslation() -
                                   world_.cam_from_world[i].InverseTranslation())
                                      .norm());
    }
    return largest;
  }

  Random random_{5};
  SyntheticWorld world_;
  BundleProblem problem_;
};

TEST_F(FactorProblem, MeasuredPositionsHoldPlaceAndScale) {
  Disturb(Sim3(1.1, RotationExp({0.05, -0.03, 0.1}), {0.5, -0.3, 0.2}));
  const BundleReport report = AdjustBundle(&problem_, {.max_iterations = 50});
  EXPECT_TRUE(report.converged);
  EXPECT_LT(LargestError(), 0.03);
}

TEST_F(FactorProblem, HeightStepsHoldTheHeightWherePositionsDoNot) {
  for (PositionFactor& factor : problem_.factors.positions) factor.per_sigma.z() = 0;
  problem_.factors.positions[0].per_sigma.z() = 10;
  for (int i = 1; i < 12; ++i) {
    const double step = world_.cam_from_world[static_cast<size_t>(i)].InverseTranslation().z() -
                        world_.cam_from_world[static_cast<size_t>(i - 1)].InverseTranslation().z();
    problem_.factors.height_steps.push_back({i - 1, i, kCentre, kCentre, step, 20});
  }
  Disturb(Sim3(1.02, RotationExp({0.02, -0.02, 0.05}), {0.2, -0.1, 0.1}));
  AdjustBundle(&problem_, {.max_iterations = 50});
  EXPECT_LT(LargestError(), 0.08);
}

TEST_F(FactorProblem, DistancesHoldTheScaleWherePositionsHardlyTellIt) {
  for (PositionFactor& factor : problem_.factors.positions) factor.per_sigma.setConstant(0.01);
  for (int i = 0; i < 12; i += 3) {
    const double apart =
        (world_.cam_from_world[static_cast<size_t>(i)].InverseTranslation() -
         world_.cam_from_world[static_cast<size_t>((i + 4) % 12)].InverseTranslation())
            .norm();
    problem_.factors.distances.push_back({i, (i + 4) % 12, apart, 1000});
  }
  Disturb(Sim3(1.02, Eigen::Quaterniond::Identity(), {0, 0, 0}));
  AdjustBundle(&problem_, {.max_iterations = 50});
  EXPECT_LT(LargestError(), 0.03) << "of 0.2";
}

TEST_F(FactorProblem, TheGradientIsHalfTheDerivativeOfTheCost) {
  problem_.factors.height_steps.push_back({2, 9, {0.1, 0, 0}, {0, 0.2, 0}, 0.7, 3});
  problem_.factors.levels.push_back({4, 5});
  problem_.factors.distances.push_back({2, 4, 3, 2});
  const BundleStructure structure(problem_);
  const HuberLoss loss{5.991};
  const BundleState state{
      {problem_.pinhole, 0, 0}, problem_.cam_from_world, problem_.landmarks_world};
  BundleLinearisation linearisation;
  linearisation.Compute(structure, state, loss, {});
  for (int camera : {0, 2, 4, 9}) {
    const auto cost = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
      BundleState moved = state;
      SE3& pose = moved.cam_from_world[static_cast<size_t>(camera)];
      pose = Moved(pose, d);
      return Eigen::VectorXd::Constant(1, BundleCost(structure, moved, loss));
    };
    const Eigen::VectorXd numeric = 0.5 * NumericJacobian(cost, 6).transpose();
    const Vector6d& gradient = linearisation.camera_gradient[static_cast<size_t>(camera)];
    EXPECT_LT((gradient - numeric).norm(), 1e-4 * (1 + numeric.norm())) << camera;
  }
}

TEST_F(FactorProblem, CamerasThatShareNoLandmarkShareABlockByTheirFactor) {
  // Each landmark is seen from one side only.
  std::erase_if(problem_.observations,
                [](const BundleObservation& o) { return (o.camera < 6) != (o.landmark < 100); });
  problem_.factors.height_steps.push_back({11, 0, kCentre, kCentre, 0, 3});
  const BundleStructure structure(problem_);
  ASSERT_EQ(structure.camera_pairs.size(), 1u);
  EXPECT_EQ(structure.camera_pairs[0].row, 11);
  const BundleState state{
      {problem_.pinhole, 0, 0}, problem_.cam_from_world, problem_.landmarks_world};
  BundleLinearisation linearisation;
  linearisation.Compute(structure, state, HuberLoss{5.991}, {});
  BundleStep dense_step, sparse_step;
  ReducedCameraSystem dense(structure, 1000), sparse(structure, 1);
  ASSERT_TRUE(dense.Solve(linearisation, 1e-3, &dense_step));
  ASSERT_TRUE(sparse.Solve(linearisation, 1e-3, &sparse_step));
  const Eigen::MatrixXd matrix = dense.matrix().toDense();
  EXPECT_GT((matrix.block<6, 6>(66, 0).norm()), 0);
  for (size_t i = 0; i < 12; ++i)
    EXPECT_LT((dense_step.camera[i] - sparse_step.camera[i]).norm(), 1e-9);
}

TEST_F(FactorProblem, AWrongFactorIsRefused) {
  problem_.factors.levels.push_back({12, 1});
  EXPECT_THROW(AdjustBundle(&problem_, {}), Error);
  problem_.factors.levels.clear();
  problem_.factors.height_steps.push_back({3, 3, kCentre, kCentre, 0, 1});
  EXPECT_THROW(AdjustBundle(&problem_, {}), Error);
  problem_.factors.height_steps.clear();
  problem_.factors.distances.push_back({0, 12, 1, 1});
  EXPECT_THROW(AdjustBundle(&problem_, {}), Error);
  problem_.factors.distances = {{0, 1, std::nan(""), 1}};
  EXPECT_THROW(AdjustBundle(&problem_, {}), Error);
}

}  // namespace
}  // namespace deepuav
