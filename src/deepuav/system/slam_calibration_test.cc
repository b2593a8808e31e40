// What a run makes of a calibration that does not fit.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deepuav/estimation/bundle/bundle_camera.h"
#include "deepuav/system/testing/slam_runs.h"

namespace deepuav {
namespace {

TEST(Slam, AWrongFocalLengthStillTracksOrSaysWhy) {
  SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(60), kNoise, 12);
  for (const double factor : {0.95, 1.05}) {
    flight.camera.pinhole.fx = flight.camera.pinhole.fy = factor * 450;
    const Outcome run = Fly(flight);
    EXPECT_EQ(run.result.failure, "");
    ASSERT_EQ(run.result.frames.size(), 60u);
    for (const FrameRecord& record : run.result.frames) {
      EXPECT_NE(record.located(), !record.reason.empty()) << record.id.value;
      if (record.located()) {
        EXPECT_TRUE(record.cam_from_world.Matrix().allFinite());
      }
    }
    if (Located(run.result) > 30) {
      EXPECT_LT(PathError(run.result, flight), 0.5);
    }
  }
}

/// As seen through a lens that the calibration does not know of.
SyntheticFlight Distorted(SyntheticFlight flight, double k1) {
  const Pinhole& pinhole = flight.camera.pinhole;
  const BundleCamera lens{pinhole, k1};
  for (Features& features : flight.features) {
    for (Keypoint& keypoint : features.keypoints) {
      keypoint.px = lens.Project(pinhole.Unproject(keypoint.px.cast<double>())).cast<float>();
      keypoint.image_px = keypoint.px;
    }
  }
  return flight;
}

TEST(Slam, CorrectsACalibrationWithoutTheLensThatTheImagesHave) {
  constexpr double kK1 = -0.03;
  const SyntheticFlight flight =
      Distorted(MakeFlight(BoxWorld(), WeavingPath(100), kNoise, 3), kK1);
  SystemOptions options;
  options.mapping.lens.min_keyframes = 5;
  const Outcome corrected = Fly(flight, Schedule::kSequential, options);
  options.mapping.lens.enabled = false;
  const Outcome plain = Fly(flight, Schedule::kSequential, options);
  EXPECT_FALSE(plain.result.lens);
  EXPECT_EQ(plain.slam->camera().lens, LensModel::kPinhole);
  ASSERT_TRUE(corrected.result.lens);
  const Camera& camera = corrected.slam->camera();
  ASSERT_EQ(camera.lens, LensModel::kRadialTangential);
  EXPECT_NEAR(camera.distortion[0], kK1, 0.1 * std::abs(kK1));
  EXPECT_EQ(Located(corrected.result), 100);
  EXPECT_LT(PathError(corrected.result, flight), 0.7 * PathError(plain.result, flight));
  // The map is of the corrected camera, key points and all.
  corrected.slam->atlas().At({0}).keyframes().ForEach([&](const Keyframe& keyframe) {
    for (const Keypoint& keypoint : keyframe.features().keypoints) {
      const auto px = camera.Undistort(keypoint.image_px.cast<double>());
      ASSERT_TRUE(px);
      EXPECT_LT((*px - keypoint.px.cast<double>()).norm(), 0.2);
    }
  });
}

TEST(Slam, ALargeCorrectionNeedsASmallerShareOfTheErrors) {
  constexpr double kK1 = -0.03;  // About 6 px at the corners.
  const SyntheticFlight flight =
      Distorted(MakeFlight(BoxWorld(), WeavingPath(100), kNoise, 3), kK1);
  SystemOptions options;
  options.mapping.lens.min_keyframes = 5;
  options.mapping.lens.min_cost_share = 0.99;  // As among larger errors.
  const Outcome corrected = Fly(flight, Schedule::kSequential, options);
  ASSERT_TRUE(corrected.result.lens);
  EXPECT_NEAR(corrected.slam->camera().distortion[0], kK1, 0.1 * std::abs(kK1));
  EXPECT_GT(corrected.result.lens_shift_px, options.mapping.lens.large_px);
  options.mapping.lens.large_px = 2 * corrected.result.lens_shift_px;
  EXPECT_FALSE(Fly(flight, Schedule::kSequential, options).result.lens) << "not large any more";
  options.mapping.lens.large_px = 0;
  options.mapping.lens.min_large_share = 0.99;
  EXPECT_FALSE(Fly(flight, Schedule::kSequential, options).result.lens) << "not told any more";
}

TEST(Slam, FollowsALensRoundByRoundWhereOneFindsTooLittle) {
  const SyntheticFlight flight =
      Distorted(MakeFlight(BoxWorld(), WeavingPath(100), kNoise, 3), -0.03);
  SystemOptions options;
  options.mapping.lens.min_keyframes = 5;
  options.mapping.lens.radial_sigma = 0.003;  // So that a round finds a part.
  const Outcome followed = Fly(flight, Schedule::kSequential, options);
  options.mapping.lens.min_later_share = options.mapping.lens.min_cost_share;
  const Outcome at_once = Fly(flight, Schedule::kSequential, options);
  ASSERT_TRUE(followed.result.lens && at_once.result.lens);
  EXPECT_LT(followed.slam->camera().distortion[0], 1.5 * at_once.slam->camera().distortion[0]);
  EXPECT_LT(PathError(followed.result, flight), 0.6 * PathError(at_once.result, flight));
}

TEST(Slam, LeavesACalibrationThatFitsAsItIs) {
  SystemOptions options;
  options.mapping.lens.min_keyframes = 5;
  const SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(100), kNoise, 3);
  const Outcome run = Fly(flight, Schedule::kSequential, options);
  EXPECT_FALSE(run.result.lens);
  EXPECT_EQ(run.slam->camera().lens, LensModel::kPinhole);
}

TEST(Slam, SaysThatAToldFocalLengthIsWrong) {
  SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(100), kNoise, 3);
  const double true_fx = flight.camera.pinhole.fx;
  SystemOptions options;
  options.mapping.lens.min_keyframes = 5;
  for (const double factor : {0.9, 1.0, 1.1}) {
    // Pixels of a camera without lens do not depend on what is known of it.
    flight.camera.pinhole.fx = flight.camera.pinhole.fy = factor * true_fx;
    const Outcome run = Fly(flight, Schedule::kSequential, options);
    EXPECT_EQ(run.result.focal_doubt.has_value(), factor != 1) << factor;
    EXPECT_EQ(run.slam->camera().pinhole.fx, factor * true_fx) << "kept as told";
    EXPECT_EQ(run.slam->camera().lens, LensModel::kPinhole) << "and its distortion";
    if (const auto& doubt = run.result.focal_doubt) {
      EXPECT_LT(std::abs(factor * doubt->ratio - 1), 0.7 * std::abs(factor - 1)) << "nearer to it";
      EXPECT_GT(doubt->sigma, 0);
    }
  }
  options.mapping.lens.min_focal_error = 0.3;
  EXPECT_FALSE(Fly(flight, Schedule::kSequential, options).result.focal_doubt) << "borne now";
  options.mapping.lens.min_focal_error = 0;
  options.mapping.lens.min_focal_sigmas = 1e6;
  EXPECT_FALSE(Fly(flight, Schedule::kSequential, options).result.focal_doubt) << "unsure now";
  options.mapping.lens.min_focal_sigmas = 0;
  options.mapping.lens.min_focal_share = 0.9;
  EXPECT_FALSE(Fly(flight, Schedule::kSequential, options).result.focal_doubt) << "useless now";
  options.mapping.lens.min_focal_share = 0;
  options.mapping.lens.whole = true;
  EXPECT_FALSE(Fly(flight, Schedule::kSequential, options).result.focal_doubt) << "none was told";
}

TEST(Slam, AWrongDistortionDoesNotMakeAFocalLengthWrong) {
  const SyntheticFlight flight =
      Distorted(MakeFlight(BoxWorld(), WeavingPath(100), kNoise, 3), -0.1);
  SystemOptions options;
  options.mapping.lens.min_keyframes = 5;
  const Outcome run = Fly(flight, Schedule::kSequential, options);
  EXPECT_FALSE(run.result.focal_doubt);
  EXPECT_TRUE(run.result.lens) << "corrected";
}

TEST(Slam, MendsAllOfALensThatIsNoMoreThanAGuess) {
  constexpr double kK1 = -0.03;
  SyntheticFlight flight = Distorted(MakeFlight(BoxWorld(), WeavingPath(100), kNoise, 3), kK1);
  const Pinhole true_pinhole = flight.camera.pinhole;
  // Pixels of a camera without lens do not depend on what is known of it.
  flight.camera.pinhole.fx = flight.camera.pinhole.fy = 1.04 * true_pinhole.fx;
  flight.camera.pinhole.cx += 2;
  SystemOptions options;
  options.mapping.lens.min_keyframes = 5;
  const Outcome plain = Fly(flight, Schedule::kSequential, options);
  options.mapping.lens.whole = true;
  const Outcome mended = Fly(flight, Schedule::kSequential, options);
  ASSERT_TRUE(mended.result.lens);
  EXPECT_GT(mended.result.lens_shift_px, 2);
  const Camera& camera = mended.slam->camera();
  EXPECT_NEAR(camera.pinhole.fx / true_pinhole.fx, 1, 0.01);
  EXPECT_NEAR(camera.distortion[0], kK1, 0.3 * std::abs(kK1));
  EXPECT_LT(PathError(mended.result, flight), 0.5 * PathError(plain.result, flight));
}

}  // namespace
}  // namespace deepuav
