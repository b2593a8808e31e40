#include "deepuav/estimation/bundle_linearization.h"

#include <gtest/gtest.h>

#include "deepuav/estimation/reduced_camera_system.h"
#include "support/estimation_problems.h"
#include "support/numeric_jacobian.h"

namespace deepuav {
namespace {

constexpr RefinedCalibration kAll{true, true, true, true, true};

/// Of any direction.
PixelNoise RandomNoise(Random* random) {
  PixelNoise noise;
  noise.xx = static_cast<float>(random->Uniform(0.3, 4));
  noise.yy = static_cast<float>(random->Uniform(0.3, 4));
  noise.xy = static_cast<float>(random->Uniform(-0.25, 0.25));
  return noise;
}

/// A small problem away from its minimum, with a fixed camera and a landmark that one camera sees
/// twice.
struct SmallProblem {
  SmallProblem() {
    Random random(1);
    SyntheticWorld world;
    world.landmarks_world = LandmarksInBox(12, {-3, -3, -2}, {3, 3, 2}, &random);
    world.cam_from_world = OrbitPath(4, {0, 0, 0}, 10, 2, 1);
    problem = MakeBundleProblem(world, {3, 0}, &random);
    for (BundleObservation& o : problem.observations) o.noise = RandomNoise(&random);
    BundleObservation twice = problem.observations.back();
    twice.px.x() += 2;
    problem.observations.push_back(twice);
    problem.k1 = -0.1;
    problem.k2 = 0.03;
    problem.p1 = 0.01;
    problem.p2 = -0.02;
    problem.readout_s = 0.1;
    for (BundleObservation& o : problem.observations)
      o.drift_cam_per_s = random.Uniform(-0.5, 0.5) * Eigen::Vector3d(1, 0.3, -0.2);
  }
  BundleState State() const {
    return {{problem.pinhole, problem.k1, problem.k2, problem.p1, problem.p2, problem.readout_s},
            problem.cam_from_world,
            problem.landmarks_world};
  }

  BundleProblem problem;
};

TEST(BundleCamera, JacobiansEqualCentralDifferences) {
  Random random(2);
  const BundleCamera camera{{450, 440, 376, 240}, -0.2, 0.05, 0.01, -0.02};
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d point(random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(2, 6));
    const auto of_point = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
      return camera.Project(point + Eigen::Vector3d(d));
    };
    const auto of_calibration = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
      return camera.Moved(VectorCalibration(d)).Project(point);
    };
    EXPECT_LT((camera.PointJacobian(point) - NumericJacobian(of_point, 3)).norm(), 1e-5);
    const Eigen::MatrixXd numeric = NumericJacobian(of_calibration, kCalibrationParameters);
    EXPECT_LT((camera.CalibrationJacobian(point) - numeric).norm(), 1e-5);
  }
}

TEST(BundleLinearization, GradientIsHalfTheDerivativeOfTheCost) {
  const SmallProblem small;
  BundleStructure structure(small.problem);
  // As strong as the observations.
  structure.focal_prior = {0.8 * small.problem.pinhole.fx, 1000};
  structure.centre_prior = {{small.problem.pinhole.cx + 10, small.problem.pinhole.cy - 4}, 0.5};
  structure.small_prior = {100, 200, 1000, 50};
  const HuberLoss loss{5.991};
  const BundleState state = small.State();
  BundleLinearization linearization;
  linearization.Compute(structure, state, loss, kAll);
  const int cameras = structure.free_cameras(), groups = structure.groups();
  ASSERT_EQ(cameras, 3);
  const auto cost = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    BundleState moved = state;
    for (int i = 0; i < cameras; ++i) {
      SE3& pose = moved.cam_from_world[structure.camera_of_free[i]];
      pose = SE3::Exp(Vector6d(d.segment<6>(6 * i))) * pose;
    }
    for (int g = 0; g < groups; ++g) {
      moved.landmarks_world[structure.landmark_of_group[g]] += d.segment<3>(6 * cameras + 3 * g);
    }
    moved.camera = state.camera.Moved(VectorCalibration(d.tail<kCalibrationParameters>()));
    return Eigen::VectorXd::Constant(1, BundleCost(structure, moved, loss));
  };
  const Eigen::VectorXd numeric =
      NumericJacobian(cost, 6 * cameras + 3 * groups + kCalibrationParameters).transpose() / 2;
  for (int i = 0; i < cameras; ++i) {
    const Vector6d& gradient = linearization.camera_gradient[i];
    EXPECT_LT((gradient - numeric.segment<6>(6 * i)).norm(), 1e-5 * gradient.norm());
  }
  for (int g = 0; g < groups; ++g) {
    const Eigen::Vector3d& gradient = linearization.landmark_gradient[g];
    EXPECT_LT((gradient - numeric.segment<3>(6 * cameras + 3 * g)).norm(), 1e-5 * gradient.norm());
  }
  const VectorCalibration& gradient = linearization.calibration_gradient;
  EXPECT_LT((gradient - numeric.tail<kCalibrationParameters>()).norm(), 1e-5 * gradient.norm());
}

/// The full damped system, assembled block by block and solved without any elimination.
Eigen::VectorXd SolveDensely(const BundleStructure& structure,
                             const BundleLinearization& linearization, double damping) {
  const int cameras = structure.free_cameras(), groups = structure.groups();
  const int landmark_begin = 6 * cameras, calibration = landmark_begin + 3 * groups;
  const int size = calibration + kCalibrationParameters;
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd gradient(size);
  const auto add = [&](int row, int column, const Eigen::MatrixXd& block) {
    hessian.block(row, column, block.rows(), block.cols()) += block;
    if (row != column) hessian.block(column, row, block.cols(), block.rows()) += block.transpose();
  };
  for (int i = 0; i < cameras; ++i) {
    add(6 * i, 6 * i, linearization.camera_camera[i]);
    add(6 * i, calibration, linearization.camera_calibration[i]);
    gradient.segment<6>(6 * i) = linearization.camera_gradient[i];
  }
  for (int g = 0; g < groups; ++g) {
    add(landmark_begin + 3 * g, landmark_begin + 3 * g, linearization.landmark_landmark[g]);
    add(calibration, landmark_begin + 3 * g, linearization.calibration_landmark[g]);
    gradient.segment<3>(landmark_begin + 3 * g) = linearization.landmark_gradient[g];
  }
  for (size_t i = 0; i < structure.observations.size(); ++i) {
    const GroupedObservation& o = structure.observations[i];
    if (o.free_camera >= 0)
      add(6 * o.free_camera, landmark_begin + 3 * o.group, linearization.camera_landmark[i]);
  }
  add(calibration, calibration, linearization.calibration_calibration);
  gradient.tail<kCalibrationParameters>() = linearization.calibration_gradient;
  hessian.diagonal() *= 1 + damping;
  return -hessian.ldlt().solve(gradient);
}

TEST(ReducedCameraSystem, StepEqualsThatOfTheFullSystem) {
  const SmallProblem small;
  const BundleStructure structure(small.problem);
  BundleLinearization linearization;
  linearization.Compute(structure, small.State(), HuberLoss{5.991}, kAll);
  const double damping = 0.01;
  const Eigen::VectorXd expected = SolveDensely(structure, linearization, damping);
  const double tolerance = 1e-7 * expected.norm();
  for (int sparse_cameras : {1, 1000}) {
    ReducedCameraSystem system(structure, sparse_cameras);
    BundleStep step;
    ASSERT_TRUE(system.Solve(linearization, damping, &step));
    for (int i = 0; i < structure.free_cameras(); ++i) {
      EXPECT_LT((step.camera[i] - expected.segment<6>(6 * i)).norm(), tolerance);
    }
    for (int g = 0; g < structure.groups(); ++g) {
      EXPECT_LT(
          (step.landmark[g] - expected.segment<3>(6 * structure.free_cameras() + 3 * g)).norm(),
          tolerance);
    }
    EXPECT_LT((step.calibration - expected.tail<kCalibrationParameters>()).norm(), tolerance);
    EXPECT_GT(step.predicted_decrease, 0);
  }
}

TEST(ReducedCameraSystem, PredictsTheDecreaseOfASmallStep) {
  const SmallProblem small;
  const BundleStructure structure(small.problem);
  const HuberLoss loss{1e9};
  const BundleState state = small.State();
  BundleLinearization linearization;
  linearization.Compute(structure, state, loss, {false, false});
  ReducedCameraSystem system(structure);
  BundleStep step;
  ASSERT_TRUE(
      system.Solve(linearization, 1e3, &step));  // Heavily damped: the quadratic model holds.
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
