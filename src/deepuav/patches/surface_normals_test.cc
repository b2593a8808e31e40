#include "deepuav/patches/surface_normals.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

constexpr double kFocalPx = 400;

/// The plane of points X with normal X = offset, as a camera in the origin sees it.
struct SeenPlane {
  Eigen::Vector3d normal;
  double offset = 0;

  SurfacePoint At(const Eigen::Vector2d& direction) const {
    return {direction, normal.dot(direction.homogeneous()) / offset};
  }
  Eigen::Vector3d TowardsCamera() const { return -normal.normalized(); }
};

/// Ground 20 below a camera that looks ahead, 40 degrees down.
SeenPlane Ground() {
  const double down_rad = 40 * M_PI / 180;
  return {{0, std::cos(down_rad), std::sin(down_rad)}, 20};
}

std::vector<SurfacePoint> Around(const SeenPlane& plane, int count, Random* random) {
  std::vector<SurfacePoint> points;
  for (int i = 0; i < count; ++i)
    points.push_back(plane.At({random->Uniform(-0.1, 0.3), random->Uniform(-0.1, 0.3)}));
  return points;
}

double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / M_PI;
}

SurfacePoint Middle(const SeenPlane& plane) { return plane.At({0.1, 0.1}); }

Eigen::Vector3d Facing(const SurfacePoint& point) {
  return -point.direction.homogeneous().normalized();
}

TEST(SurfaceNormals, OfAPlane) {
  Random random(1);
  const SeenPlane ground = Ground();
  const SurfaceNormals normals(Around(ground, 60, &random), kFocalPx, {});
  const Eigen::Vector3d normal = normals.At(Middle(ground));
  EXPECT_NEAR(normal.norm(), 1, 1e-12);
  EXPECT_LT(AngleDeg(normal, ground.TowardsCamera()), 0.5);
  EXPECT_GT(AngleDeg(Facing(Middle(ground)), ground.TowardsCamera()), 40) << "what is to be found";
}

TEST(SurfaceNormals, AThirdOfThePointsLyingElsewhereDoesNotBendIt) {
  Random random(2);
  const SeenPlane ground = Ground();
  std::vector<SurfacePoint> points = Around(ground, 90, &random);
  for (size_t i = 0; i < points.size(); i += 3) points[i].inverse_depth *= random.Uniform(1.3, 2);
  EXPECT_LT(
      AngleDeg(SurfaceNormals(points, kFocalPx, {}).At(Middle(ground)), ground.TowardsCamera()), 6);
}

TEST(SurfaceNormals, PointsOfUnknownDistanceBendNothing) {
  Random random(3);
  const SurfacePoint middle{{0.1, 0.1}, 0.05};
  double known_deg = 0, taken_for_known_deg = 0;
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<SurfacePoint> points;
    for (int i = 0; i < 12; ++i) {
      const double off = 1 + std::clamp(random.Gaussian(0.4), -0.9, 2.0);
      points.push_back({{random.Uniform(0, 0.2), random.Uniform(0, 0.2)},
                        off * middle.inverse_depth,
                        0.4 * middle.inverse_depth});
    }
    known_deg += AngleDeg(SurfaceNormals(points, kFocalPx, {}).At(middle), Facing(middle)) / 20;
    for (SurfacePoint& point : points) point.sigma = 0;
    taken_for_known_deg +=
        AngleDeg(SurfaceNormals(points, kFocalPx, {}).At(middle), Facing(middle)) / 20;
  }
  EXPECT_LT(known_deg, 0.8 * taken_for_known_deg);
}

TEST(SurfaceNormals, FacesTheCameraWhereNothingTells) {
  Random random(4);
  const SeenPlane ground = Ground();
  const SurfacePoint middle = Middle(ground);
  EXPECT_LT(AngleDeg(SurfaceNormals({}, kFocalPx, {}).At(middle), Facing(middle)), 1e-6);
  EXPECT_LT(AngleDeg(SurfaceNormals({middle}, kFocalPx, {}).At(middle), Facing(middle)), 1e-6)
      << "itself alone";
  const std::vector<SurfacePoint> points = Around(ground, 60, &random);
  EXPECT_LT(
      AngleDeg(SurfaceNormals(points, kFocalPx, {.enabled = false}).At(middle), Facing(middle)),
      1e-6);
  EXPECT_LT(AngleDeg(SurfaceNormals(points, kFocalPx, {.max_distance_px = 1e-3}).At(middle),
                     Facing(middle)),
            1e-6)
      << "too far away";
}

TEST(SurfaceNormals, PointsOnALineLeaveTheSlopeAcrossToThePrior) {
  const SeenPlane ground = Ground();
  std::vector<SurfacePoint> points;
  for (int i = -6; i <= 6; ++i) points.push_back(ground.At({0.1 + 0.01 * i, 0.1}));
  const Eigen::Vector3d normal = SurfaceNormals(points, kFocalPx, {}).At(Middle(ground));
  EXPECT_TRUE(normal.allFinite());
  // Along the line the inverse depth is that of the ground.
  const Eigen::Vector3d along =
      ground.At({0.15, 0.1}).direction.homogeneous() / ground.At({0.15, 0.1}).inverse_depth -
      ground.At({0.1, 0.1}).direction.homogeneous() / ground.At({0.1, 0.1}).inverse_depth;
  EXPECT_NEAR(normal.dot(along.normalized()), 0, 0.01);
}

TEST(SurfacePoint, IsSeenInFrontWithTheNoiseAlongTheAxis) {
  constexpr double kFocal = 500, kDepthSigma = 0.3;
  // Looks along the world's x axis.
  const SE3 cam_from_world(
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ()),
      Eigen::Vector3d(0, 0, 2));
  Eigen::Matrix3d noise = Eigen::Vector3d(kDepthSigma, 5, 7).cwiseAbs2().asDiagonal();
  noise *= kFocal * kFocal;
  const Eigen::Vector3d point_cam(0.4, -0.8, 4);
  const auto seen = SeenBy(cam_from_world, cam_from_world.Inverse() * point_cam, noise, kFocal);
  ASSERT_TRUE(seen);
  EXPECT_LT((seen->direction - Eigen::Vector2d(0.1, -0.2)).norm(), 1e-12);
  EXPECT_NEAR(seen->inverse_depth, 0.25, 1e-12);
  EXPECT_NEAR(seen->sigma, kDepthSigma / 16, 1e-12);
  const Eigen::Vector3d behind = cam_from_world.Inverse() * Eigen::Vector3d(0, 0, -1);
  EXPECT_FALSE(SeenBy(cam_from_world, behind, noise, kFocal));
}

TEST(SurfaceNormalOptions, RefusesWhatCannotBe) {
  EXPECT_ANY_THROW(SurfaceNormalOptions{.neighbours = 2}.Check());
  EXPECT_ANY_THROW(SurfaceNormalOptions{.slope_sigma = 0}.Check());
  EXPECT_NO_THROW(SurfaceNormalOptions{}.Check());
}

}  // namespace
}  // namespace deepuav
