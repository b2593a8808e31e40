#include "deepuav/patches/patch_measurement.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "deepuav/base/random.h"
#include "support/textured_plane.h"

namespace deepuav {
namespace {

Camera PinholeCamera() { return {320, 240, {300, 310, 160, 120}, LensModel::kPinhole, {}, 0}; }

Camera WideCamera() {
  return {320, 240, {180, 182, 158, 121}, LensModel::kRadialTangential, {-0.28, 0.07, 2e-4, 1e-5},
          0};
}

SE3 Pose(const Eigen::Vector3d& rotation, const Eigen::Vector3d& translation) {
  return SE3(RotationExp(rotation), translation);
}

struct Case {
  bool wide = false;
  Eigen::Vector3d rotation, translation;
};

class PatchMeasurementTest : public ::testing::TestWithParam<Case> {};

TEST_P(PatchMeasurementTest, FindsWhereTheOtherViewShowsThePoint) {
  const auto& [wide, rotation, translation] = GetParam();
  const Camera camera = wide ? WideCamera() : PinholeCamera();
  const SE3 b_from_a = Pose(rotation, translation);
  const TexturedPlane world;
  const ImagePyramid a(world.Render(camera, SE3()), 3), b(world.Render(camera, b_from_a), 3);
  Random random(3);
  for (const auto& [x, y] : {std::pair(150, 110), {110, 150}, {215, 90}}) {
    const Eigen::Vector2d px_a(x, y);
    const Eigen::Vector3d point = world.Hit({0, 0, 0}, camera.pinhole.Unproject(px_a));
    const Eigen::Vector3d point_b = b_from_a * point;
    const Eigen::Vector2d truth = camera.pinhole.Project(point_b);
    const Eigen::Vector2d image_px =
        *camera.Distort(point_b) + 0.4 * Eigen::Vector2d(random.Gaussian(1), random.Gaussian(1));
    const auto measured =
        MeasurePatch(a, {px_a, point, world.Normal()}, b_from_a, b,
                     {image_px, *camera.Undistort(image_px)}, camera, PatchOptions{});
    ASSERT_TRUE(measured) << px_a.transpose();
    EXPECT_LT((measured->px.cast<double>() - truth).norm(), 0.1) << px_a.transpose();
    EXPECT_TRUE(measured->noise.usable());
  }
}

INSTANTIATE_TEST_SUITE_P(Views, PatchMeasurementTest,
                         ::testing::Values(Case{false, {0, 0, 0}, {0.3, 0.1, 0}},
                                           Case{false, {0.1, -0.15, 0.8}, {0.4, -0.3, 0.2}},
                                           Case{false, {0, 0, 3.0}, {0, 0, 3.2}},
                                           Case{true, {0.05, -0.1, 0.3}, {0.4, 0.2, -0.3}}));

TEST(PatchMeasurement, KnowsThatRowsAreReadOneAfterTheOther) {
  const Camera camera = WideCamera();
  const SE3 b_from_a = Pose({0.05, -0.1, 0.1}, {0.4, 0.2, -0.3});
  const ReadoutMotion motion_a{{0.02, 0.03, -0.02}, {0.05, -0.1, 0.02}},
      motion_b{{-0.03, 0.01, 0.03}, {-0.08, 0.06, 0.1}};
  const TexturedPlane world;
  const ImagePyramid a(world.Render(camera, SE3(), motion_a), 3),
      b(world.Render(camera, b_from_a, motion_b), 3);
  for (const auto& [x, y] : {std::pair(150, 60), {110, 180}, {215, 90}}) {
    const Eigen::Vector2d px_a(x, y);
    const Eigen::Vector3d point = world.Hit({0, 0, 0}, camera.pinhole.Unproject(px_a));
    const Eigen::Vector3d point_b = b_from_a * point;
    const Eigen::Vector2d truth = camera.pinhole.Project(point_b);
    const auto measure = [&](const ReadoutMotion& of_a, const ReadoutMotion& of_b) {
      // As a detector finds it: in its row, a bit beside.
      const Eigen::Vector2d image_px =
          *DistortInRow(camera, truth, motion_b, 1 / point_b.z()) + Eigen::Vector2d(0.4, -0.3);
      const auto measured =
          MeasurePatch(a, {px_a, point, world.Normal(), of_a}, b_from_a, b,
                       {image_px, *camera.Undistort(image_px), of_b}, camera, PatchOptions{});
      return measured ? (measured->px.cast<double>() - truth).norm() : 10;
    };
    EXPECT_LT(measure(motion_a, motion_b), 0.12) << px_a.transpose();
    EXPECT_GT(measure({}, {}), 0.4) << px_a.transpose();
  }
}

// The warp against small differences of the whole projection.
TEST(PatchWarpTest, AgreesWithDifferences) {
  const Camera camera = WideCamera();
  const TexturedPlane world;
  const SE3 b_from_a = Pose({0.1, -0.2, 0.5}, {0.5, -0.2, 0.4});
  const Eigen::Vector2d px_a(190, 95);
  const auto in_b = [&](const Eigen::Vector2d& image_px) -> Eigen::Vector2d {
    const Eigen::Vector3d ray = camera.pinhole.Unproject(*camera.Undistort(image_px));
    return *camera.Distort(b_from_a * world.Hit({0, 0, 0}, ray));
  };
  const Eigen::Vector3d point = world.Hit({0, 0, 0}, camera.pinhole.Unproject(px_a));
  const Eigen::Vector2d image_a = *camera.Distort(point);
  const auto warp = PatchWarp({px_a, point, world.Normal()}, b_from_a, camera);
  ASSERT_TRUE(warp);
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = 0.5 * Eigen::Vector2d::Unit(axis);
    const Eigen::Vector2d expected = in_b(image_a + step) - in_b(image_a - step);
    EXPECT_LT((warp->col(axis) - expected).norm(), 2e-3) << axis;
  }
}

TEST(PatchWarpTest, RefusesWhatIsNotSeenFromTheFront) {
  const Camera camera = PinholeCamera();
  const SurfacePatch patch{{160, 120}, {0, 0, 4}, {0, 0, 1}};
  EXPECT_TRUE(PatchWarp(patch, SE3(), camera));
  // From behind the plane, from beside it, and with the point behind the camera.
  EXPECT_FALSE(PatchWarp(patch, Pose({0, M_PI, 0}, {0, 0, 8}), camera));
  EXPECT_FALSE(PatchWarp(patch, Pose({0, M_PI / 2, 0}, {-4, 0, 4}), camera));
  EXPECT_FALSE(PatchWarp(patch, Pose({0, 0, 0}, {0, 0, -8}), camera));
  // A plane seen edge-on.
  EXPECT_FALSE(PatchWarp({{160, 120}, {0, 0, 4}, {1, 0, 0}}, SE3(), camera));
}

}  // namespace
}  // namespace deepuav
