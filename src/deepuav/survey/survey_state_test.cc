#include "deepuav/survey/survey_state.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/synthetic_world.h"

namespace deepuav {
namespace {

SurveyLens BentLens() {
  SurveyLens lens;
  lens.camera.pinhole = {500, 510, 320, 240};
  lens.camera.k1 = -0.2;
  lens.camera.k2 = 0.04;
  return lens;
}

TEST(SurveyLens, ARayIsSeenAtItsPixel) {
  for (const double tangential : {0.0, 0.003}) {
    SurveyLens lens = BentLens();
    lens.camera.p1 = tangential;
    lens.camera.p2 = -0.7 * tangential;
    const Pinhole& pinhole = lens.camera.pinhole;
    for (double x = 0; x <= 640; x += 80) {
      for (double y = 0; y <= 480; y += 80) {  // (320, 240), the centre, among them
        const Eigen::Vector2d px(x, y);
        const auto ray = lens.Ray(px);
        const auto straight = lens.Undistort(px);
        ASSERT_TRUE(ray && straight);
        EXPECT_EQ(ray->z(), 1);
        EXPECT_LT((lens.camera.Project(*ray) - px).norm(), 1e-3) << x << " " << y;
        EXPECT_LT((pinhole.Project(*ray) - *straight).norm(), 1e-9);
      }
    }
  }
}

TEST(SurveyLens, HasNoRayWhereItFoldsOver) {
  SurveyLens lens = BentLens();
  lens.camera.pinhole.fy = lens.camera.pinhole.fx;
  lens.camera.k1 = -0.5;
  lens.camera.k2 = 0;
  // r (1 - r^2 / 2) grows up to r = sqrt(2/3), where it is two thirds of that.
  const double end_px = 500 * 2.0 / 3 * std::sqrt(2.0 / 3);
  const auto ray = [&](double radius_px) {
    return lens.Ray(Eigen::Vector2d(320 + 0.6 * radius_px, 240 - 0.8 * radius_px));
  };
  EXPECT_TRUE(ray(0.999 * end_px));
  EXPECT_FALSE(ray(1.001 * end_px));
  EXPECT_TRUE(lens.IsOneToOne(0.999 * end_px));
  EXPECT_FALSE(lens.IsOneToOne(1.001 * end_px));
}

TEST(SurveyState, APointIsWhereTheCameraIsWhenItsRowIsRead) {
  constexpr double kReadoutS = 0.04, kRows = 480;
  const Eigen::Vector3d centre(3, -2, 40), velocity(12, 5, -1), point(8, 4, 1);
  SurveyState state({}, 2, BentLens());
  state.lens.camera.readout_s = kReadoutS;
  state.image_rows = kRows;
  state.cam_from_world[1] = LookDown(centre, 0.7);
  EXPECT_EQ(state.InCamera(point, 1, 0), *state.cam_from_world[1] * point) << "not known to move";
  state.velocity_world = {Eigen::Vector3d::Zero(), velocity};
  for (const double row : {0.0, 100.0, 239.5, 479.0}) {
    const double seconds = kReadoutS * ((row + 0.5) / kRows - 0.5);
    const Eigen::Vector3d there = LookDown(centre + seconds * velocity, 0.7) * point;
    EXPECT_LT((state.InCamera(point, 1, row) - there).norm(), 1e-9) << row;
  }
}

TEST(SurveyState, NothingIsSeenFromBehind) {
  const SurveyLens lens = BentLens();
  const Eigen::Vector3d ahead(0.3, 0.2, 2);
  const Eigen::Vector2d px = lens.camera.Project(ahead);
  EXPECT_LT(SquaredErrorPx(lens.camera, ahead, px), 1e-12);
  EXPECT_TRUE(std::isinf(SquaredErrorPx(lens.camera, -ahead, px))) << "though it projects there";
}

TEST(SurveyState, CountsTheViewsThatHaveAPose) {
  SurveyState state(Tracks(), 5, BentLens());
  EXPECT_EQ(state.ViewCount(), 0);
  EXPECT_TRUE(state.HasViews(0));
  EXPECT_FALSE(state.HasViews(1));
  state.cam_from_world[1] = state.cam_from_world[4] = SE3();
  EXPECT_EQ(state.ViewCount(), 2);
  EXPECT_TRUE(state.HasViews(2));
  EXPECT_FALSE(state.HasViews(3));
}

}  // namespace
}  // namespace deepuav
