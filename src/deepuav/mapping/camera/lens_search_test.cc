#include "deepuav/mapping/camera/lens_search.h"

#include <gtest/gtest.h>

#include "deepuav/mapping/adjustment/map_adjustment.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

constexpr FeatureNoise kNoise{0.3, 0.3, 0, 0};
const BundleOptions kBundle{.max_iterations = 50, .min_relative_decrease = 1e-6};

/// Cameras that turn around landmarks, of a lens that the calibration does not know of, adjusted.
SyntheticMap MapThrough(double k1, double k2, int cameras = 24) {
  Random random(5);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(400, {-4, -4, -3}, {4, 4, 3}, &random);
  const FeatureWorld world(geometry, 6);
  SyntheticMap made =
      MakeTrueMap(world, OrbitPath(cameras, {0, 0, 0}, 12, 3, 2.5), kNoise, &random);
  const BundleCamera lens{geometry.pinhole, k1, k2};
  made.map.MovePixels([&](const Eigen::Vector2f& px) -> Eigen::Vector2f {
    return lens.Project(geometry.pinhole.Unproject(px.cast<double>())).cast<float>();
  });
  Pinhole pinhole = geometry.pinhole;
  AdjustMap(&made.map, &pinhole, kBundle, {});
  return made;
}

std::vector<SE3> PosesOf(const SyntheticMap& made) {
  std::vector<SE3> poses;
  for (const KeyframeId id : made.keyframes) poses.push_back(made.map.At(id).cam_from_world);
  return poses;
}

TEST(FindLens, FindsTheDistortionThatACalibrationLacks) {
  for (const double k1 : {-0.05, 0.04}) {
    const SyntheticMap made = MapThrough(k1, 0.01);
    const std::vector<SE3> before = PosesOf(made);
    const auto found = FindLens(made.map, SyntheticWorld().pinhole, kBundle, {});
    ASSERT_TRUE(found);
    EXPECT_GT(found->cost_share, LensSearchOptions().min_cost_share);
    // Outliers of the map without a lens are gone: not all of it is found at once.
    EXPECT_NEAR(found->camera.k1, k1, 0.3 * std::abs(k1));
    EXPECT_EQ(found->camera.pinhole.fx, SyntheticWorld().pinhole.fx);
    EXPECT_GT(found->sigmas.k1, 0);
    EXPECT_LT(found->sigmas.k1, 0.01);
    const std::vector<SE3> after = PosesOf(made);
    for (size_t i = 0; i < before.size(); ++i)
      EXPECT_EQ(before[i].translation(), after[i].translation());
  }
}

TEST(FindLens, LeavesACalibrationThatFits) {
  EXPECT_FALSE(FindLens(MapThrough(0, 0).map, SyntheticWorld().pinhole, kBundle, {}));
}

TEST(FindLens, WhatAdjustingAloneSavesIsNoReason) {
  SyntheticMap made = MapThrough(0, 0);
  Random random(8);
  std::vector<LandmarkId> landmarks;
  made.map.landmarks().ForEach([&](const Landmark& l) { landmarks.push_back(l.id); });
  for (const LandmarkId id : landmarks) {
    const Eigen::Vector3d moved = made.map.At(id).position_world + 0.01 * RandomDirection(&random);
    made.map.SetPosition(id, moved);
  }
  EXPECT_FALSE(FindLens(made.map, SyntheticWorld().pinhole, kBundle, {}));
}

TEST(FindLens, NeedsKeyframes) {
  const SyntheticMap made = MapThrough(-0.05, 0, 10);
  EXPECT_FALSE(FindLens(made.map, SyntheticWorld().pinhole, kBundle, {}));
  EXPECT_TRUE(FindLens(made.map, SyntheticWorld().pinhole, kBundle, {.min_keyframes = 10}));
}

TEST(FindLens, FindsNothingWhenStopped) {
  const SyntheticMap made = MapThrough(-0.05, 0);
  const auto stop = [] { return true; };
  EXPECT_FALSE(FindLens(made.map, SyntheticWorld().pinhole, kBundle, {}, stop));
}

TEST(FindLens, OfAnEmptyMapIsNothing) {
  EXPECT_FALSE(FindLens(Map(MapId{0}), SyntheticWorld().pinhole, kBundle, {.min_keyframes = 2}));
}

/// What a camera of this calibration makes of images that another lens took.
SyntheticMap MapOfImages(const Camera& took, const Camera& calibrated) {
  Random random(5);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(400, {-4, -4, -3}, {4, 4, 3}, &random);
  geometry.pinhole = took.pinhole;
  const FeatureWorld world(geometry, 6);
  SyntheticMap made = MakeTrueMap(world, OrbitPath(24, {0, 0, 0}, 12, 3, 2.5), kNoise, &random);
  made.map.MovePixels([&](const Eigen::Vector2f& px) -> Eigen::Vector2f {
    const auto image_px = took.Distort(took.pinhole.Unproject(px.cast<double>()));
    const auto seen = image_px ? calibrated.Undistort(*image_px) : std::nullopt;
    return seen ? Eigen::Vector2f(seen->cast<float>()) : px;
  });
  Pinhole pinhole = calibrated.pinhole;
  AdjustMap(&made.map, &pinhole, kBundle, {});
  return made;
}

Camera CameraOf(Camera camera, const BundleCamera& lens) {
  camera.pinhole = lens.pinhole;
  camera.distortion = {lens.k1, lens.k2, lens.p1, lens.p2};
  return camera;
}

Camera Through(double focal_factor, double centre_shift_px, double k1) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.pinhole = SyntheticWorld().pinhole;
  camera.pinhole.fx *= focal_factor;
  camera.pinhole.fy *= focal_factor;
  camera.pinhole.cx += centre_shift_px;
  camera.lens = LensModel::kRadialTangential;
  camera.distortion = {k1, 0.01, 0.0002, 0};
  return camera;
}

TEST(FindWholeLens, FindsFocalLengthCentreAndDistortion) {
  const Camera took = Through(1, 0, -0.1), calibrated = Through(1.02, 4, -0.06);
  const SyntheticMap made = MapOfImages(took, calibrated);
  const auto found = FindWholeLens(made.map, calibrated, calibrated.pinhole, kBundle, {});
  ASSERT_TRUE(found);
  EXPECT_GT(found->cost_share, LensSearchOptions().min_cost_share);
  EXPECT_NEAR(found->camera.pinhole.fx / took.pinhole.fx, 1, 0.007);
  EXPECT_NEAR(found->camera.pinhole.cx, took.pinhole.cx, 1.5);
  EXPECT_NEAR(found->camera.k1, -0.1, 0.015);
  EXPECT_GT(found->sigmas.focal, 0);
  EXPECT_GT(found->sigmas.centre, 0);
  EXPECT_LT(found->sigmas.focal, 0.005);
}

TEST(FindWholeLens, LeavesALensThatFits) {
  const Camera camera = Through(1, 0, -0.1);
  const SyntheticMap made = MapOfImages(camera, camera);
  EXPECT_FALSE(FindWholeLens(made.map, camera, camera.pinhole, kBundle, {}));
  // Or to noise alone.
  const auto found =
      FindWholeLens(made.map, camera, camera.pinhole, kBundle, {.min_cost_share = 0});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->camera.pinhole.fx / camera.pinhole.fx, 1, 4 * found->sigmas.focal);
  EXPECT_NEAR(found->camera.k1, camera.distortion[0], 4 * found->sigmas.k1);
}

TEST(FindWholeLens, GivesTheMapThatGoesWithIt) {
  const Camera took = Through(1, 0, -0.1), calibrated = Through(1.02, 4, -0.06);
  SyntheticMap made = MapOfImages(took, calibrated);
  const auto found = FindWholeLens(made.map, calibrated, calibrated.pinhole, kBundle, {});
  ASSERT_TRUE(found);
  WriteBack(found->adjusted, &made.map);
  const Camera lens = CameraOf(took, found->camera);
  double squared_px = 0;
  int seen = 0;
  made.map.landmarks().ForEach([&](const Landmark& landmark) {
    for (const Observation& observation : landmark.observations) {
      const Keyframe& keyframe = made.map.At(observation.keyframe);
      const auto taken_px =
          calibrated.Distort(calibrated.pinhole.Unproject(observation.measured.px.cast<double>()));
      const auto expected_px = lens.Distort(keyframe.cam_from_world * landmark.position_world);
      ASSERT_TRUE(taken_px && expected_px);
      squared_px += (*taken_px - *expected_px).squaredNorm();
      ++seen;
    }
  });
  EXPECT_LT(std::sqrt(squared_px / seen), 1);
}

TEST(FindWholeLens, NeedsKeyframesAndTime) {
  const Camera took = Through(1, 0, -0.1), calibrated = Through(1.02, 4, -0.06);
  const SyntheticMap made = MapOfImages(took, calibrated);
  EXPECT_FALSE(
      FindWholeLens(made.map, calibrated, calibrated.pinhole, kBundle, {.min_keyframes = 100}));
  EXPECT_FALSE(
      FindWholeLens(made.map, calibrated, calibrated.pinhole, kBundle, {}, [] { return true; }));
}

TEST(IsWhollySearchable, AreBrownsLensesWithoutTheThirdRadial) {
  Camera camera = Through(1, 0, -0.1);
  EXPECT_TRUE(IsWhollySearchable(camera));
  camera.distortion.push_back(0.01);
  EXPECT_FALSE(IsWhollySearchable(camera));
  camera.lens = LensModel::kEquidistant;
  camera.distortion.resize(4);
  EXPECT_FALSE(IsWhollySearchable(camera));
  camera.lens = LensModel::kPinhole;
  camera.distortion.clear();
  EXPECT_TRUE(IsWhollySearchable(camera));
}

}  // namespace
}  // namespace deepuav
