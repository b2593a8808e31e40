#include "deepuav/estimation/bundle/bundle_linearisation.h"

#include <gtest/gtest.h>

#include "deepuav/estimation/testing/small_bundle.h"
#include "support/numeric_jacobian.h"

namespace deepuav {
namespace {

constexpr RefinedCalibration kAll{true, true, true, true, true};

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

TEST(BundleLinearisation, GradientIsHalfTheDerivativeOfTheCost) {
  const SmallProblem small;
  BundleStructure structure(small.problem);
  // As strong as the observations.
  structure.focal_prior = {0.8 * small.problem.pinhole.fx, 1000};
  structure.centre_prior = {{small.problem.pinhole.cx + 10, small.problem.pinhole.cy - 4}, 0.5};
  structure.small_prior = {100, 200, 1000, 50, {-0.1, 0.02}};
  const HuberLoss loss{5.991};
  const BundleState state = small.State();
  BundleLinearisation linearisation;
  linearisation.Compute(structure, state, loss, kAll);
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
    const Vector6d& gradient = linearisation.camera_gradient[i];
    EXPECT_LT((gradient - numeric.segment<6>(6 * i)).norm(), 1e-5 * gradient.norm());
  }
  for (int g = 0; g < groups; ++g) {
    const Eigen::Vector3d& gradient = linearisation.landmark_gradient[g];
    EXPECT_LT((gradient - numeric.segment<3>(6 * cameras + 3 * g)).norm(), 1e-5 * gradient.norm());
  }
  const VectorCalibration& gradient = linearisation.calibration_gradient;
  EXPECT_LT((gradient - numeric.tail<kCalibrationParameters>()).norm(), 1e-5 * gradient.norm());
}

}  // namespace
}  // namespace deepuav
