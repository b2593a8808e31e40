#include "deepuav/geometry/se3.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

// Where series and closed forms meet, and near the half turn.
constexpr double kAngles[] = {0,   1e-12, 1e-8, 0.99e-5,     1.01e-5,     1e-4,        1e-2,
                              0.5, 1.5,   3.0,  M_PI - 1e-4, M_PI - 1e-7, M_PI - 1e-10};

Eigen::Vector3d RandomVector(Random* random) {
  return {random->Gaussian(1), random->Gaussian(1), random->Gaussian(1)};
}

SE3 RandomPose(Random* random) {
  return SE3(RotationExp(RandomVector(random)), 3 * RandomVector(random));
}

void ExpectNear(const SE3& a, const SE3& b, double tolerance) {
  EXPECT_LT((a.Matrix() - b.Matrix()).cwiseAbs().maxCoeff(), tolerance);
}

TEST(Skew, IsTheCrossProduct) {
  const Eigen::Vector3d a(1, -2, 3), b(0.5, 4, -1);
  EXPECT_TRUE((Skew(a) * b).isApprox(a.cross(b)));
}

TEST(Rotation, ExpIsTheTurnAboutTheAxis) {
  Random random(1);
  for (const double angle : kAngles) {
    const Eigen::Vector3d axis = RandomVector(&random).normalized();
    const Eigen::Matrix3d expected = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    const Eigen::Matrix3d found = RotationExp(angle * axis).toRotationMatrix();
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-14) << angle;
  }
}

TEST(Rotation, LogInvertsExp) {
  Random random(2);
  for (const double angle : kAngles) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d vector = angle * RandomVector(&random).normalized();
      EXPECT_LT((RotationLog(RotationExp(vector)) - vector).norm(), 1e-14 * (1 + 10 * angle))
          << angle;
    }
  }
}

TEST(Rotation, LogTakesTheShorterWay) {
  const Eigen::Vector3d axis(0, 0, 1);
  EXPECT_TRUE(RotationLog(RotationExp(4.0 * axis)).isApprox((4.0 - 2 * M_PI) * axis, 1e-12));
  const Eigen::Quaterniond q = RotationExp({0.1, 0.2, 0.3});
  const Eigen::Quaterniond negated(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_TRUE(RotationLog(negated).isApprox(Eigen::Vector3d(0.1, 0.2, 0.3), 1e-12));
}

TEST(Rotation, HalfTurnHasAngleAndAxis) {
  const Eigen::Vector3d log = RotationLog(RotationExp(M_PI * Eigen::Vector3d::UnitY()));
  EXPECT_NEAR(log.norm(), M_PI, 1e-12);
  EXPECT_NEAR(std::abs(log.y()), M_PI, 1e-12);
}

// Exp(v + d) = Exp(J(v) d) Exp(v) to first order.
TEST(Rotation, LeftJacobianIsTheDerivativeOfExp) {
  Random random(3);
  const double step = 1e-6;
  for (const double angle : kAngles) {
    const Eigen::Vector3d vector = angle * RandomVector(&random).normalized();
    Eigen::Matrix3d numeric;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d offset = step * Eigen::Vector3d::Unit(i);
      numeric.col(i) =
          RotationLog(RotationExp(vector + offset) * RotationExp(vector - offset).conjugate()) /
          (2 * step);
    }
    EXPECT_LT((RotationLeftJacobian(vector) - numeric).cwiseAbs().maxCoeff(), 1e-8) << angle;
  }
}

TEST(SE3, LogInvertsExp) {
  Random random(4);
  for (const double angle : kAngles) {
    for (int i = 0; i < 20; ++i) {
      Vector6d twist;
      twist.head<3>() = 5 * RandomVector(&random);
      twist.tail<3>() = angle * RandomVector(&random).normalized();
      EXPECT_LT((SE3::Exp(twist).Log() - twist).norm(), 1e-9) << angle;
    }
  }
}

// The exponential of a twist is the limit of many small steps along it.
TEST(SE3, ExpIsTheFlowOfTheTwist) {
  Vector6d twist;
  twist << 1, -2, 0.5, 0.7, 0.4, -1.1;
  SE3 flow = SE3::Exp(twist / 1048576);
  for (int i = 0; i < 20; ++i) flow = flow * flow;
  ExpectNear(flow, SE3::Exp(twist), 1e-8);
}

TEST(SE3, IsAGroup) {
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    const SE3 a = RandomPose(&random), b = RandomPose(&random), c = RandomPose(&random);
    ExpectNear(a * a.Inverse(), SE3(), 1e-13);
    ExpectNear(a.Inverse() * a, SE3(), 1e-13);
    ExpectNear((a * b) * c, a * (b * c), 1e-13);
    ExpectNear((a * b).Inverse(), b.Inverse() * a.Inverse(), 1e-13);
    EXPECT_LT(((a * b).Matrix() - a.Matrix() * b.Matrix()).cwiseAbs().maxCoeff(), 1e-13);
  }
}

TEST(SE3, MovesPoints) {
  Random random(6);
  const SE3 a = RandomPose(&random), b = RandomPose(&random);
  const Eigen::Vector3d point = RandomVector(&random);
  EXPECT_LT(((a * b) * point - a * (b * point)).norm(), 1e-13);
  EXPECT_LT((a * point - (a.Matrix() * point.homogeneous()).head<3>()).norm(), 1e-13);
  EXPECT_LT((a * a.InverseTranslation()).norm(), 1e-13);
  EXPECT_LT((a.InverseTranslation() - a.Inverse().translation()).norm(), 1e-13);
}

TEST(SE3, NormalisesItsRotation) {
  const SE3 pose(Eigen::Quaterniond(2, 0, 0, 2), {1, 2, 3});
  EXPECT_NEAR(pose.rotation().norm(), 1, 1e-15);
  EXPECT_NEAR(pose.Angle(), M_PI / 2, 1e-12);
}

TEST(SE3, StaysRigidOverManyProducts) {
  Random random(7);
  const SE3 step = RandomPose(&random);
  SE3 pose;
  for (int i = 0; i < 100000; ++i) pose = pose * step;
  EXPECT_NEAR(pose.rotation().norm(), 1, 1e-14);
}

/// Normalising again would change the last bits of some.
TEST(SE3, IsRestoredToTheBit) {
  Random random(7);
  for (int i = 0; i < 1000; ++i) {
    const SE3 pose = RandomPose(&random) * RandomPose(&random);
    const SE3 restored = SE3::FromUnit(pose.rotation(), pose.translation());
    ASSERT_EQ(restored.rotation().coeffs(), pose.rotation().coeffs());
    ASSERT_EQ(restored.translation(), pose.translation());
  }
}

}  // namespace
}  // namespace deepuav
