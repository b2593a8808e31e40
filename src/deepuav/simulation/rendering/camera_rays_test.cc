#include "deepuav/simulation/rendering/camera_rays.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/random.h"
#include "deepuav/simulation/rendering/flow.h"
#include "deepuav/simulation/testing/small_world.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

class RaysOfALens : public testing::TestWithParam<LensModel> {
 protected:
  /// The pixel to which the lens brings a ray.
  Vector2d PixelOf(const Eigen::Vector2f& ray) const {
    const auto pixel = camera_.Distort(Vector3d(ray.x(), ray.y(), 1));
    EXPECT_TRUE(pixel);
    return pixel.value_or(Vector2d(1e9, 1e9));
  }

  const Camera camera_ = TestCamera(GetParam());
  const CameraRays rays_{camera_, 2};
};

TEST_P(RaysOfALens, ComeBackToTheirPixelsOverTheWholeImage) {
  for (int y = 0; y < camera_.height; y += camera_.height / 2 - 1) {
    for (int x = 0; x < camera_.width; ++x)
      ASSERT_LT((PixelOf(rays_.At(x, y)) - Vector2d(x, y)).norm(), 1e-3) << x << " " << y;
  }
  for (const int x : {0, camera_.width - 1}) {
    for (int y = 0; y < camera_.height; ++y)
      ASSERT_LT((PixelOf(rays_.At(x, y)) - Vector2d(x, y)).norm(), 1e-3) << x << " " << y;
  }
}

TEST_P(RaysOfALens, BetweenPixelsAreStraightInterpolations) {
  for (int y = 0; y < camera_.height; y += 13) {
    for (int x = 0; x < camera_.width; x += 11) {
      const Eigen::Vector2f offset(0.49f * std::sin(0.7f * static_cast<float>(x)),
                                   0.49f * std::cos(0.9f * static_cast<float>(y)));
      const Vector2d wanted = Vector2d(x, y) + offset.cast<double>();
      ASSERT_LT((PixelOf(rays_.At(x, y, offset)) - wanted).norm(), 5e-3) << x << " " << y;
    }
  }
}

TEST_P(RaysOfALens, AtTheBorderGoOutwardsToo) {
  const int right = camera_.width - 1, bottom = camera_.height - 1;
  for (const auto& [x, y, dx, dy] : {std::tuple(0, 0, -0.5f, -0.5f),
                                     {right, 0, 0.5f, -0.5f},
                                     {0, bottom, -0.5f, 0.5f},
                                     {right, bottom, 0.5f, 0.5f}}) {
    const Vector2d wanted(x + dx, y + dy);
    EXPECT_LT((PixelOf(rays_.At(x, y, {dx, dy})) - wanted).norm(), 0.02) << wanted.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(Lenses, RaysOfALens,
                         testing::Values(LensModel::kPinhole, LensModel::kRadialTangential,
                                         LensModel::kEquidistant),
                         [](const auto& lens) {
                           return std::to_string(static_cast<int>(lens.param));
                         });

TEST(CameraRaysOfOnePixel, AreOne) {
  Camera camera;
  camera.width = camera.height = 1;
  camera.pinhole = {100, 100, 0, 0};
  const CameraRays rays(camera, 3);
  EXPECT_EQ(rays.At(0, 0, {0.4f, -0.4f}), Eigen::Vector2f(0, 0));
}

TEST(CameraRaysWhereTheLensHasNone, AreNoNumbers) {
  Camera camera = TestCamera(LensModel::kEquidistant);
  camera.pinhole.fx = camera.pinhole.fy = 60;  // 180 degrees and more to the corners.
  const CameraRays rays(camera, 1);
  EXPECT_TRUE(std::isnan(rays.At(0, 0).x()));
  EXPECT_TRUE(rays.At(187, 119).allFinite());
  EXPECT_EQ(std::isnan(rays.At(0, 0).x()), !camera.Undistort({0, 0}).has_value());
}

/// The same pixel searched without rounds: by halving the rows of the moment.
std::optional<Vector2d> SearchPixel(const Camera& camera,
                                    const std::function<SE3(double)>& world_from_cam,
                                    const std::function<Vector3d(double)>& point) {
  const auto seen_at = [&](double row) {
    return camera.Distort(world_from_cam(row).Inverse() * point(row));
  };
  double low = -camera.height / 2.0, high = camera.height * 1.5;
  for (int i = 0; i < 60; ++i) {
    const double row = (low + high) / 2;
    const auto pixel = seen_at(row);
    if (!pixel) return std::nullopt;
    (pixel->y() > row ? low : high) = row;
  }
  return seen_at(low);
}

// The truth of flow takes a row's pose for all of the row: half a row's motion is what it errs by.
TEST(RowwiseProjectionTruth, ErrsByLessThanHalfARowsMotion) {
  const Camera camera = TestCamera(LensModel::kRadialTangential);
  constexpr double kRowS = 4e-5;
  const auto path = [](double row) { return Flight(0.3 + kRowS * row); };
  const auto moving = [](const Vector3d& start) {
    return [start](double row) -> Vector3d { return start + row * kRowS * Vector3d(12, -5, 0); };
  };
  const RowwiseProjection projection(camera, false, path);
  Random random(8);
  int seen = 0;
  double worst_px = 0;
  for (int i = 0; i < 400; ++i) {
    const Vector3d in_view(random.Uniform(-0.7, 0.7), random.Uniform(-0.45, 0.45), 1);
    const auto point = moving(path(120) * (random.Uniform(15, 90) * in_view));
    const auto expected = SearchPixel(camera, path, point);
    const auto found = projection.Project(point, random.Uniform(0, 240));
    if (!expected || !found) continue;
    ++seen;
    const Vector2d then = *camera.Distort(path(100).Inverse() * point(100)),
                   later = *camera.Distort(path(101).Inverse() * point(101));
    EXPECT_LT((*found - *expected).norm(), 0.75 * (later - then).norm() + 1e-4);
    worst_px = std::max(worst_px, (*found - *expected).norm());
  }
  EXPECT_GT(seen, 300);
  EXPECT_LT(worst_px, 0.01);
}

TEST(RowwiseProjectionTruth, OfAPointThatMovesDependsOnTheMovement) {
  const Camera camera = TestCamera(LensModel::kPinhole);
  const RowwiseProjection projection(camera, false, [](double) { return SE3(); });
  // It crosses by 0.01 px a row: from row 0 on, at its own row.
  const auto crossing = [&](double row) {
    return Vector3d(0.01 * row / camera.pinhole.fx, 30 / camera.pinhole.fy, 1);
  };
  const auto pixel = projection.Project(crossing, 0);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->y(), camera.pinhole.cy + 30, 1e-6);
  EXPECT_NEAR(pixel->x(), camera.pinhole.cx + 0.01 * pixel->y(), 1e-6);
}

}  // namespace
}  // namespace deepuav
