#include "deepuav/map/visibility.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

Camera TestCamera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.pinhole = {400, 400, 320, 240};
  return camera;
}

/// Seen so far by cameras at the origin's distance, straight along z.
LocalLandmark LandmarkAt(const Eigen::Vector3d& position) {
  LocalLandmark landmark{{0}, position, -position.normalized(), position.norm(), position.norm(),
                         2};
  return landmark;
}

bool Expected(const LocalLandmark& landmark, const SE3& cam_from_world,
              const VisibilityOptions& options = {}) {
  return ExpectedPixel(landmark, cam_from_world, TestCamera(), options).has_value();
}

SE3 At(const Eigen::Vector3d& centre) { return SE3(Eigen::Quaterniond::Identity(), -centre); }

TEST(ExpectedPixel, IsTheProjection) {
  const auto px = ExpectedPixel(LandmarkAt({1, 0.5, 4}), SE3(), TestCamera(), {});
  ASSERT_TRUE(px);
  EXPECT_LT((*px - Eigen::Vector2d(420, 290)).norm(), 1e-12);
}

TEST(ExpectedPixel, NothingBehindTheCameraOrOutsideTheImage) {
  EXPECT_FALSE(Expected(LandmarkAt({0, 0, -4}), SE3()));
  EXPECT_FALSE(Expected(LandmarkAt({0, 0, 0}), SE3()));
  EXPECT_TRUE(Expected(LandmarkAt({3.18, 0, 4}), SE3()));
  EXPECT_FALSE(Expected(LandmarkAt({3.21, 0, 4}), SE3()));
  EXPECT_TRUE(Expected(LandmarkAt({0, -2.39, 4}), SE3()));
  EXPECT_FALSE(Expected(LandmarkAt({0, -2.41, 4}), SE3()));
}

TEST(ExpectedPixel, NothingFromTooNearOrTooFar) {
  const LocalLandmark landmark = LandmarkAt({0, 0, 10});
  EXPECT_TRUE(Expected(landmark, At({0, 0, 4.9})));
  EXPECT_FALSE(Expected(landmark, At({0, 0, 5.1})));
  EXPECT_TRUE(Expected(landmark, At({0, 0, -9.9})));
  EXPECT_FALSE(Expected(landmark, At({0, 0, -10.1})));
  EXPECT_TRUE(Expected(landmark, At({0, 0, -19}), {.max_distance_factor = 3}));
}

TEST(ExpectedPixel, NothingFromTheSide) {
  const LocalLandmark landmark = LandmarkAt({0, 0, 10});
  for (const double angle_deg : {0.0, 30.0, 59.0, 61.0, 120.0, 180.0}) {
    const double angle = angle_deg * M_PI / 180;
    // On a circle around the landmark, always looking at it.
    const Eigen::Quaterniond world_from_cam = RotationExp({0, angle, 0});
    const Eigen::Vector3d centre =
        landmark.position_world - world_from_cam * landmark.position_world;
    const SE3 cam_from_world = SE3(world_from_cam, centre).Inverse();
    EXPECT_EQ(Expected(landmark, cam_from_world), angle_deg < 60) << angle_deg;
  }
}

TEST(ExpectedPixel, NothingWhereTheLensDoesNotReach) {
  Camera camera = TestCamera();
  camera.lens = LensModel::kRadialTangential;
  camera.distortion = {0.3, 0, 0, 0};  // pincushion: rays near the border leave the image
  camera.Check("test");
  const LocalLandmark inside = LandmarkAt({1.5, 0, 4}), near_border = LandmarkAt({3.1, 0, 4});
  const auto px = ExpectedPixel(inside, SE3(), camera, {});
  ASSERT_TRUE(px);
  EXPECT_NEAR(px->x(), 470, 1e-9) << "the pixel is that of the undistorted camera";
  EXPECT_FALSE(ExpectedPixel(near_border, SE3(), camera, {}));
  EXPECT_TRUE(ExpectedPixel(near_border, SE3(), TestCamera(), {}));

  camera.distortion = {-0.2, 0, 0, 0};  // barrel: what lies outside the pinhole image may be seen
  const auto outside = ExpectedPixel(LandmarkAt({3.3, 0, 4}), SE3(), camera, {});
  ASSERT_TRUE(outside);
  EXPECT_GT(outside->x(), 640);
}

TEST(ExpectedPixel, IsTheSameForALandmarkAndItsCopy) {
  Random random(1);
  int seen = 0;
  for (int i = 0; i < 500; ++i) {
    Landmark landmark;
    landmark.position_world = {random.Uniform(-5, 5), random.Uniform(-5, 5), random.Uniform(-2, 9)};
    landmark.mean_view_direction =
        Eigen::Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), -1).normalized();
    landmark.min_distance = random.Uniform(1, 6);
    landmark.max_distance = landmark.min_distance + random.Uniform(0, 4);
    const LocalLandmark copy{
        landmark.id,           landmark.position_world, landmark.mean_view_direction,
        landmark.min_distance, landmark.max_distance,   2};
    const auto a = ExpectedPixel(landmark, SE3(), TestCamera(), {});
    const auto b = ExpectedPixel(copy, SE3(), TestCamera(), {});
    ASSERT_EQ(a.has_value(), b.has_value());
    if (a) {
      EXPECT_EQ(*a, *b);
    }
    seen += a.has_value();
  }
  EXPECT_GT(seen, 50);
  EXPECT_LT(seen, 450);
}

TEST(VisibilityOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(VisibilityOptions().Check());
  EXPECT_THROW((VisibilityOptions{.max_view_angle_deg = 90}.Check()), Error);
  EXPECT_THROW((VisibilityOptions{.max_distance_factor = 0.9}.Check()), Error);
}

}  // namespace
}  // namespace deepuav
