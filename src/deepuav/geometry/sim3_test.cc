#include "deepuav/geometry/sim3.h"

#include <gtest/gtest.h>

#include <unsupported/Eigen/MatrixFunctions>

#include "deepuav/base/random.h"
#include "support/numeric_jacobian.h"

namespace deepuav {
namespace {

Eigen::Vector3d RandomVector(Random* random) {
  return {random->Gaussian(1), random->Gaussian(1), random->Gaussian(1)};
}

SE3 RandomPose(Random* random) {
  return SE3(RotationExp(RandomVector(random)), 3 * RandomVector(random));
}

Sim3 RandomSim3(Random* random) { return Sim3(RandomPose(random), random->Uniform(0.2, 5)); }

void ExpectNear(const Sim3& a, const Sim3& b) {
  EXPECT_NEAR(a.scale(), b.scale(), 1e-12 * b.scale());
  EXPECT_LT(a.rotation().angularDistance(b.rotation()), 1e-7);
  EXPECT_LT((a.translation() - b.translation()).norm(), 1e-11);
}

TEST(Sim3, ScalesThenTurnsThenShifts) {
  const Sim3 transform(2, RotationExp({0, 0, M_PI / 2}), {10, 0, 0});
  EXPECT_LT((transform * Eigen::Vector3d(1, 2, 3) - Eigen::Vector3d(6, 2, 6)).norm(), 1e-12);
}

TEST(Sim3, IsAGroup) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Sim3 a = RandomSim3(&random), b = RandomSim3(&random), c = RandomSim3(&random);
    ExpectNear(a * a.Inverse(), Sim3());
    ExpectNear(a.Inverse() * a, Sim3());
    ExpectNear((a * b) * c, a * (b * c));
    ExpectNear((a * b).Inverse(), b.Inverse() * a.Inverse());
    ExpectNear(a * Sim3(), a);
  }
}

TEST(Sim3, ProductMovesPointsAsItsFactorsDo) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Sim3 a = RandomSim3(&random), b = RandomSim3(&random);
    const Eigen::Vector3d point = RandomVector(&random);
    EXPECT_LT(((a * b) * point - a * (b * point)).norm(), 1e-11);
    EXPECT_LT((a.Inverse() * (a * point) - point).norm(), 1e-11);
  }
}

TEST(Sim3, OfScaleOneIsRigid) {
  Random random(3);
  const SE3 a = RandomPose(&random), b = RandomPose(&random);
  ExpectNear(Sim3(a) * Sim3(b), Sim3(a * b));
  ExpectNear(Sim3(a).Inverse(), Sim3(a.Inverse()));
}

// A camera that moved with its world sees the moved points in the same directions, at scaled
// depths.
TEST(Sim3, MovePoseKeepsWhatTheCameraSees) {
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    const Sim3 new_from_old = RandomSim3(&random);
    const SE3 cam_from_old = RandomPose(&random);
    const SE3 cam_from_new = new_from_old.MovePose(cam_from_old);
    const Eigen::Vector3d point = RandomVector(&random);
    EXPECT_LT(
        (cam_from_new * (new_from_old * point) - new_from_old.scale() * (cam_from_old * point))
            .norm(),
        1e-11);
    EXPECT_LT((cam_from_new.InverseTranslation() - new_from_old * cam_from_old.InverseTranslation())
                  .norm(),
              1e-11);
  }
}

Eigen::Matrix4d Matrix(const Sim3& transform) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = transform.scale() * transform.rotation().toRotationMatrix();
  matrix.topRightCorner<3, 1>() = transform.translation();
  return matrix;
}

Vector7d RandomTangent(double angle, double log_scale, Random* random) {
  Vector7d tangent;
  tangent.head<3>() = 3 * RandomVector(random);
  tangent.segment<3>(3) = angle * RandomVector(random).normalized();
  tangent[6] = log_scale;
  return tangent;
}

TEST(Sim3, ExpIsTheMatrixExponential) {
  Random random(6);
  for (double angle : {0.0, 1e-9, 1e-5, 1e-3, 0.1, 1.0, 3.0, M_PI}) {
    for (double log_scale : {0.0, 1e-12, -1e-9, 1e-5, -1e-3, 0.1, -0.7, 2.3, -2.3, 8.0, -8.0}) {
      const Vector7d tangent = RandomTangent(angle, log_scale, &random);
      Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
      generator.topLeftCorner<3, 3>() =
          Skew(tangent.segment<3>(3)) + log_scale * Eigen::Matrix3d::Identity();
      generator.topRightCorner<3, 1>() = tangent.head<3>();
      const Eigen::Matrix4d expected = generator.exp();
      EXPECT_LT((Matrix(Sim3::Exp(tangent)) - expected).norm(), 1e-12 * expected.norm())
          << "angle " << angle << ", log scale " << log_scale;
    }
  }
}

TEST(Sim3, LogUndoesExp) {
  Random random(7);
  for (double angle : {0.0, 1e-9, 1e-4, 0.1, 1.0, 3.1}) {
    for (double log_scale : {0.0, 1e-12, -1e-5, 0.3, -2.3, 2.3, -20.0, 20.0}) {
      const Vector7d tangent = RandomTangent(angle, log_scale, &random);
      EXPECT_LT((Sim3::Exp(tangent).Log() - tangent).norm(), 1e-11)
          << "angle " << angle << ", log scale " << log_scale;
    }
  }
}

TEST(Sim3, OfScaleOneHasTheExponentialOfRigidTransforms) {
  Random random(8);
  const Vector7d tangent = RandomTangent(0.8, 0, &random);
  ExpectNear(Sim3::Exp(tangent), Sim3(SE3::Exp(tangent.head<6>())));
}

TEST(Sim3, AdjointMovesTangents) {
  Random random(9);
  for (int i = 0; i < 20; ++i) {
    const Sim3 a = RandomSim3(&random);
    const Vector7d tangent = RandomTangent(0.3, random.Gaussian(0.2), &random);
    ExpectNear(a * Sim3::Exp(tangent) * a.Inverse(), Sim3::Exp(a.Adjoint() * tangent));
  }
}

TEST(Sim3, LeftJacobianInverseEqualsCentralDifferences) {
  Random random(10);
  for (double angle : {0.0, 1e-4, 0.3, 1.0, 3.0}) {
    for (double log_scale : {0.0, 1e-4, 0.3, -1.0}) {
      const Vector7d tangent = RandomTangent(angle, log_scale, &random);
      const auto left = [&](const Eigen::VectorXd& delta) -> Eigen::VectorXd {
        return (Sim3::Exp(Vector7d(delta)) * Sim3::Exp(tangent)).Log();
      };
      const auto right = [&](const Eigen::VectorXd& delta) -> Eigen::VectorXd {
        return (Sim3::Exp(tangent) * Sim3::Exp(Vector7d(delta))).Log();
      };
      const Eigen::MatrixXd expected_left = NumericJacobian(left, 7);
      const Eigen::MatrixXd expected_right = NumericJacobian(right, 7);
      const double bound = angle > 1 ? 2e-3 : 1e-7;  // The series is cut.
      EXPECT_LT((Sim3LeftJacobianInverse(tangent) - expected_left).norm(),
                bound * expected_left.norm());
      EXPECT_LT((Sim3LeftJacobianInverse(-tangent) - expected_right).norm(),
                bound * expected_right.norm());
    }
  }
}

TEST(Sim3, MovePoseFollowsProducts) {
  Random random(5);
  const Sim3 a = RandomSim3(&random), b = RandomSim3(&random);
  const SE3 pose = RandomPose(&random);
  ExpectNear(Sim3(a.MovePose(b.MovePose(pose))), Sim3((a * b).MovePose(pose)));
  ExpectNear(Sim3(a.Inverse().MovePose(a.MovePose(pose))), Sim3(pose));
}

}  // namespace
}  // namespace deepuav
