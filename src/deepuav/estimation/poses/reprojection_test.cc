#include "deepuav/estimation/poses/reprojection.h"

#include <gtest/gtest.h>

#include "support/numeric_jacobian.h"
#include "support/synthetic_world.h"

namespace deepuav {
namespace {

TEST(PoseJacobian, EqualsCentralDifferences) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const SE3 pose = Perturbed(SE3(), 1, random.Uniform(0, 3), &random);
    const Eigen::Vector3d point_cam(random.Uniform(-3, 3), random.Uniform(-3, 3),
                                    random.Uniform(1, 6));
    const Eigen::Vector3d point_world = pose.Inverse() * point_cam;
    Matrix23d project =
        Matrix23d::Random();  // Any linear function of the point has this chain rule.
    const auto function = [&](const Eigen::VectorXd& twist) -> Eigen::VectorXd {
      return project * (SE3::Exp(Vector6d(twist)) * pose * point_world);
    };
    const Eigen::MatrixXd difference =
        PoseJacobian(project, point_cam) - NumericJacobian(function, 6);
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-7);
  }
}

TEST(HuberLoss, IsContinuousAndItsWeightIsItsDerivative) {
  const HuberLoss loss{5.991};
  for (double squared : {0.1, 3.0, 5.99, 6.0, 100.0, 1e6}) {
    const auto cost = [&](const Eigen::VectorXd& delta) -> Eigen::VectorXd {
      return Eigen::VectorXd::Constant(1, loss.Cost(squared + delta[0]));
    };
    EXPECT_NEAR(loss.Weight(squared), NumericJacobian(cost, 1, 1e-4 * squared)(0, 0), 1e-5);
  }
  EXPECT_NEAR(loss.Cost(5.991 - 1e-9), loss.Cost(5.991 + 1e-9), 1e-6);
}

}  // namespace
}  // namespace deepuav
