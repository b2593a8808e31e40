#include "deepuav/geometry/triangulation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

Eigen::Vector3d RandomVector(Random* random, double sigma) {
  return {random->Gaussian(sigma), random->Gaussian(sigma), random->Gaussian(sigma)};
}

Eigen::Vector3d Ray(const SE3& cam_from_world, const Eigen::Vector3d& point, double noise = 0,
                    Random* random = nullptr) {
  const Eigen::Vector3d in_camera = cam_from_world * point;
  Eigen::Vector3d ray = in_camera / in_camera.z();
  if (noise > 0) ray.head<2>() += RandomVector(random, noise).head<2>();
  return ray;
}

// Two cameras a metre apart, both looking about along z.
struct TwoCameras {
  SE3 a_from_world, b_from_world;
};

TwoCameras RandomCameras(Random* random) {
  const SE3 a(RotationExp(RandomVector(random, 0.1)), RandomVector(random, 0.2));
  const SE3 b_from_a(RotationExp(RandomVector(random, 0.05)), Eigen::Vector3d(-1, 0.1, 0.05));
  return {a, b_from_a * a};
}

TEST(TriangulatePoint, FindsExactPoints) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const auto [a, b] = RandomCameras(&random);
    const Eigen::Vector3d point(random.Uniform(-3, 3), random.Uniform(-3, 3),
                                random.Uniform(3, 50));
    const auto found = TriangulatePoint(a, Ray(a, point), b, Ray(b, point));
    ASSERT_TRUE(found);
    EXPECT_LT((*found - point).norm(), 1e-9 * point.squaredNorm());
  }
}

// With a noise of half a pixel at 450 px, the depth's standard deviation is sqrt(2) sigma z^2 /
// baseline.
TEST(TriangulatePoint, NoiseGivesTheExpectedError) {
  Random random(2);
  constexpr int kTrials = 2000;
  constexpr double kSigma = 0.5 / 450, kDepth = 8;
  const SE3 a, b(Eigen::Quaterniond::Identity(), {-1, 0, 0});
  double squared_depth_error = 0;
  for (int i = 0; i < kTrials; ++i) {
    const Eigen::Vector3d point(random.Uniform(-1, 2), random.Uniform(-1, 1), kDepth);
    const auto found =
        TriangulatePoint(a, Ray(a, point, kSigma, &random), b, Ray(b, point, kSigma, &random));
    ASSERT_TRUE(found);
    squared_depth_error += std::pow(found->z() - kDepth, 2);
    EXPECT_LT((found->head<2>() / found->z() - point.head<2>() / kDepth).norm(), 5 * kSigma);
  }
  const double expected = std::sqrt(2.0) * kSigma * kDepth * kDepth;
  EXPECT_NEAR(std::sqrt(squared_depth_error / kTrials), expected, 0.1 * expected);
}

TEST(TriangulatePoint, ParallelRaysGiveNothing) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const SE3 a(RotationExp(RandomVector(&random, 0.3)), RandomVector(&random, 1));
    const SE3 b(a.rotation(), a.translation() + Eigen::Vector3d(1, 0.3, 0));
    const Eigen::Vector3d ray(random.Uniform(-1, 1), random.Uniform(-1, 1), 1);
    EXPECT_FALSE(TriangulatePoint(a, ray, b, ray));
  }
}

TEST(TriangulatePoint, RaysThatDivergeMeetBehind) {
  const SE3 a, b(Eigen::Quaterniond::Identity(), {-1, 0, 0});
  const auto found = TriangulatePoint(a, {-0.1, 0, 1}, b, {0.1, 0, 1});
  ASSERT_TRUE(found);
  EXPECT_LT((*found - Eigen::Vector3d(0.5, 0, -5)).norm(), 1e-9);
}

// A point in front of one camera and behind the other, whose ray is the same line.
TEST(TriangulatePoint, FindsPointsBehindOneCamera) {
  const SE3 a;
  const SE3 b(RotationExp({0, M_PI - 0.2, 0}), {0.3, 0, 1});
  const Eigen::Vector3d point(0.4, 0.2, 6);
  ASSERT_LT((b * point).z(), 0);
  const auto found = TriangulatePoint(a, Ray(a, point), b, Ray(b, point));
  ASSERT_TRUE(found);
  EXPECT_LT((*found - point).norm(), 1e-9);
}

TEST(ParallaxAngle, IsTheAngleAtThePoint) {
  EXPECT_NEAR(ParallaxAngle({0, 0, 0}, {1, 0, 0}, {0, 0, 1}), M_PI / 4, 1e-15);
  EXPECT_NEAR(ParallaxAngle({-1, 0, 0}, {1, 0, 0}, {0, 0, 0}), M_PI, 1e-15);
  EXPECT_NEAR(ParallaxAngle({1, 2, 3}, {1, 2, 3}, {4, 5, 6}), 0, 1e-15);
  // Where an arc cosine would already give 0.
  EXPECT_NEAR(ParallaxAngle({0, 0, 0}, {1e-9, 0, 0}, {0, 0, 1}), 1e-9, 1e-15);
}

}  // namespace
}  // namespace deepuav
