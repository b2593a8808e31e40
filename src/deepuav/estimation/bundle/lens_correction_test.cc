#include "deepuav/estimation/bundle/lens_correction.h"

#include <gmock/gmock.h>

#include <cmath>

namespace deepuav {
namespace {

constexpr double kMaxErrorPx = 0.1;

Camera Calibrated(LensModel lens, std::vector<double> distortion) {
  return {.width = 752,
          .height = 480,
          .pinhole = {458.654, 457.296, 367.215, 248.375},
          .lens = lens,
          .distortion = std::move(distortion)};
}

const std::vector<double> kEuroc = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};

BundleCamera TakenBy(const Pinhole& pinhole) {
  BundleCamera camera{pinhole, 0.02, -0.008, 0.0005, -0.0004};
  camera.pinhole.fx *= 0.99;
  camera.pinhole.fy *= 0.99;
  camera.pinhole.cx += 0.7;
  camera.pinhole.cy -= 0.5;
  return camera;
}

/// The pixels of an image at the places of a grid.
std::vector<Eigen::Vector2d> Grid(const Camera& camera) {
  std::vector<Eigen::Vector2d> pixels;
  for (double y = 0; y < camera.height; y += 23) {
    for (double x = 0; x < camera.width; x += 31) pixels.emplace_back(x, y);
  }
  return pixels;
}

/// That pixels of the calibration's undistorted camera are moved to where they truly belong, and
/// that the corrected camera sees there what the image shows, to a root mean square of so much.
void ExpectOneCamera(const Camera& calibrated, const BundleCamera& taken_by,
                     const LensCorrection& correction, double tolerance_px) {
  double squared = 0;
  for (const Eigen::Vector2d& px : Grid(calibrated)) {
    const auto before = calibrated.Undistort(px);
    const auto after = correction.camera().Undistort(px);
    ASSERT_TRUE(before && after) << px.transpose();
    const Eigen::Vector2d moved = correction.Correct(*before);
    squared += (moved - *after).squaredNorm();
    // What is seen there, as an image of the camera that took the undistorted pixels.
    const Eigen::Vector3d ray = correction.camera().pinhole.Unproject(moved);
    EXPECT_LT((taken_by.Project(ray) - *before).norm(), 1e-6) << px.transpose();
  }
  EXPECT_LT(std::sqrt(squared / static_cast<double>(Grid(calibrated).size())), tolerance_px);
}

TEST(LensCorrection, GivesACalibrationWithoutLensTheLensThatItLacks) {
  const Camera calibrated = Calibrated(LensModel::kPinhole, {});
  const BundleCamera taken_by = TakenBy(calibrated.pinhole);
  const auto correction = LensCorrection::Of(calibrated, taken_by, kMaxErrorPx);
  ASSERT_TRUE(correction);
  EXPECT_EQ(correction->camera().lens, LensModel::kRadialTangential);
  EXPECT_THAT(correction->camera().distortion, testing::ElementsAre(0.02, -0.008, 0.0005, -0.0004));
  EXPECT_GT(correction->MeanShiftPx(), 1);
  ExpectOneCamera(calibrated, taken_by, *correction, 1e-6);
}

TEST(LensCorrection, JoinsTwoLensesIntoOne) {
  for (std::vector<double> distortion : {kEuroc, {-0.1, 0.02, 0, 0, 0.01}}) {
    const Camera calibrated = Calibrated(LensModel::kRadialTangential, distortion);
    const BundleCamera taken_by = TakenBy(calibrated.pinhole);
    const auto correction = LensCorrection::Of(calibrated, taken_by, kMaxErrorPx);
    ASSERT_TRUE(correction);
    ExpectOneCamera(calibrated, taken_by, *correction, 2 * kMaxErrorPx);
  }
}

TEST(LensCorrection, LeavesACalibrationThatFitsWhereItIs) {
  const Camera calibrated = Calibrated(LensModel::kRadialTangential, kEuroc);
  const auto correction =
      LensCorrection::Of(calibrated, BundleCamera{calibrated.pinhole}, kMaxErrorPx);
  ASSERT_TRUE(correction);
  EXPECT_LT(correction->MeanShiftPx(), 1e-6);
  EXPECT_LT(LargestDifferencePx(calibrated, correction->camera()), 1e-6);
}

TEST(LensCorrection, IsNoneWhereNoLensOfThatModelIsTheSame) {
  const Camera fisheye = Calibrated(LensModel::kEquidistant, {0.01, 0, 0, 0});
  EXPECT_FALSE(LensCorrection::Of(fisheye, TakenBy(fisheye.pinhole), kMaxErrorPx));
  const Camera calibrated = Calibrated(LensModel::kRadialTangential, kEuroc);
  EXPECT_FALSE(LensCorrection::Of(calibrated, TakenBy(calibrated.pinhole), 1e-5));
}

TEST(LensCorrection, IsNoneForALensThatFoldsOverInTheImage) {
  const Camera calibrated = Calibrated(LensModel::kPinhole, {});
  EXPECT_FALSE(LensCorrection::Of(calibrated, {calibrated.pinhole, -1.5, 0, 0, 0}, kMaxErrorPx));
}

TEST(LensCorrection, LeavesPixelsFarOutsideWhereTheyAre) {
  const Camera calibrated = Calibrated(LensModel::kPinhole, {});
  const auto correction =
      LensCorrection::Of(calibrated, {calibrated.pinhole, -0.1, 0, 0, 0}, kMaxErrorPx);
  ASSERT_TRUE(correction);
  const Eigen::Vector2d outside(1e5, 1e5);
  EXPECT_EQ(correction->Correct(outside), outside);
}

TEST(LensCorrection, TakesPixelsFromOneLensToAnother) {
  const Camera calibrated = Calibrated(LensModel::kRadialTangential, kEuroc);
  BundleCamera found{calibrated.pinhole, -0.25, 0.06, 0.001, -0.002};
  found.pinhole.fx *= 1.05;
  found.pinhole.fy *= 1.05;
  found.pinhole.cx += 6;
  const auto correction = LensCorrection::To(found, calibrated);
  ASSERT_TRUE(correction);
  EXPECT_THAT(correction->camera().distortion, testing::ElementsAre(-0.25, 0.06, 0.001, -0.002));
  EXPECT_EQ(correction->camera().pinhole.cx, found.pinhole.cx);
  EXPECT_EQ(correction->camera().width, calibrated.width);
  for (const Eigen::Vector2d& px : Grid(calibrated)) {
    const auto before = calibrated.Undistort(px), after = correction->camera().Undistort(px);
    ASSERT_TRUE(before && after) << px.transpose();
    EXPECT_LT((correction->Correct(*before) - *after).norm(), 1e-6) << px.transpose();
  }
  EXPECT_GT(correction->MeanShiftPx(), 4);
  const BundleCamera same{calibrated.pinhole, kEuroc[0], kEuroc[1], kEuroc[2], kEuroc[3]};
  EXPECT_LT(LensCorrection::To(same, calibrated)->MeanShiftPx(), 1e-6);
}

TEST(LensCorrection, GoesToNoLensThatFoldsOverInTheImage) {
  const Camera calibrated = Calibrated(LensModel::kPinhole, {});
  const BundleCamera folding{calibrated.pinhole, -0.8, 0};
  EXPECT_FALSE(LensCorrection::To(folding, calibrated));
}

TEST(MeanShiftPx, IsOfWhatBothCamerasSee) {
  const Camera camera = Calibrated(LensModel::kPinhole, {});
  EXPECT_NEAR(MeanShiftPx(camera, camera), 0, 1e-9);
  Camera moved = camera;
  moved.pinhole.cx += 3;
  moved.pinhole.cy -= 4;
  EXPECT_NEAR(MeanShiftPx(camera, moved), 5, 1e-9);
  Camera folding = Calibrated(LensModel::kRadialTangential, {-0.28, 0, 0, 0});
  Camera wide = camera;  // sees rays at its corners beyond where the other one folds over
  wide.pinhole.fx = wide.pinhole.fy = 300;
  EXPECT_TRUE(std::isfinite(MeanShiftPx(wide, folding)));
  EXPECT_GT(MeanShiftPx(wide, folding), 20);
}

}  // namespace
}  // namespace deepuav
