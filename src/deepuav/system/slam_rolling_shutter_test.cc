// What a run makes of images whose rows are read one after the other.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "deepuav/system/testing/slam_runs.h"

namespace deepuav {
namespace {

constexpr double kReadoutS = 0.02, kIntervalS = 0.05;

/// Weaving along the box, shaken about all axes.
SE3 ShakenAt(double frame, double hz) {
  const double phase = 2 * std::numbers::pi * hz * kIntervalS * frame, x = 0.15 * frame;
  const Eigen::Vector3d shake =
      0.02 * Eigen::Vector3d(std::sin(phase), std::cos(0.8 * phase), std::sin(0.9 * phase + 1));
  return SE3(RotationExp(shake),
             Eigen::Vector3d(-x, 0.3 * std::sin(0.5 * x), 0.3 * std::cos(0.4 * x)));
}

/// Every row as its own camera saw it.
SyntheticFlight ReadByRows(const FeatureWorld& world, int count, double shaking_hz,
                           double readout_s = kReadoutS) {
  Random random(7);
  SyntheticFlight flight{{}, {}, world.camera(), kIntervalS};
  flight.camera.readout_s = readout_s;
  const Pinhole& pinhole = flight.camera.pinhole;
  for (int i = 0; i < count; ++i) {
    const SE3 middle_from_world = ShakenAt(i, shaking_hz);
    const SyntheticView view = world.View(middle_from_world, {0.2, 0.3, 0, 20}, &random);
    Features features = *view.features;
    for (size_t k = 0; k < features.keypoints.size(); ++k) {
      if (view.landmark[k] < 0) continue;
      const Eigen::Vector3d& point = world.landmarks()[static_cast<size_t>(view.landmark[k])];
      Keypoint& keypoint = features.keypoints[k];
      const Eigen::Vector2d off =
          keypoint.px.cast<double>() - pinhole.Project(middle_from_world * point);
      for (int round = 0; round < 4; ++round) {
        const double moment = RowMoment(keypoint.px.y(), flight.camera.height);
        const SE3 row_from_world = ShakenAt(i + moment * readout_s / kIntervalS, shaking_hz);
        keypoint.px = (pinhole.Project(row_from_world * point) + off).cast<float>();
      }
      keypoint.image_px = keypoint.px;
    }
    flight.cam_from_world.push_back(middle_from_world);
    flight.features.push_back(std::move(features));
  }
  return flight;
}

/// Of the frames that a young map has no part in.
double ErrorOnceStarted(const SlamResult& result, const SyntheticFlight& flight) {
  std::vector<Eigen::Vector3d> estimate, truth;
  for (size_t i = 20; i < result.frames.size(); ++i) {
    estimate.push_back(result.frames[i].cam_from_world.InverseTranslation());
    truth.push_back(flight.cam_from_world[i].InverseTranslation());
  }
  return RmseAfterAlignment(estimate, truth);
}

TEST(SlamRollingShutter, FollowsTheWholePathAtTheEnd) {
  const SyntheticFlight flight = ReadByRows(BoxWorld(), 100, 2);
  SystemOptions options;
  const Outcome followed = Fly(flight, Schedule::kSequential, options);
  options.readout.rounds = 0;
  const Outcome as_they_came = Fly(flight, Schedule::kSequential, options);
  EXPECT_EQ(followed.result.failure, "");
  EXPECT_EQ(Located(followed.result), 100);
  EXPECT_LT(ErrorOnceStarted(followed.result, flight),
            0.6 * ErrorOnceStarted(as_they_came.result, flight));
}

TEST(SlamRollingShutter, StaysAsItCameWhereThePathDoesNotTell) {
  const SyntheticFlight flight = ReadByRows(BoxWorld(), 60, 2);
  SystemOptions options;
  options.image_turns.rounds = 0;
  options.readout.max_missed = options.readout.harmless_rad = 0;
  const Outcome refused = Fly(flight, Schedule::kSequential, options);
  options.readout.rounds = 0;
  EXPECT_EQ(Bytes(refused.result), Bytes(Fly(flight, Schedule::kSequential, options).result));
}

TEST(SlamRollingShutter, AsksTheImagesWhereThePathDoesNotTell) {
  constexpr double kShakingHz = 8.3;
  const SyntheticFlight flight = ReadByRows(BoxWorld(), 100, kShakingHz);
  SystemOptions options;
  options.image_turns.min_keyframes = 3;
  const Outcome asked = Fly(flight, Schedule::kSequential, options);
  EXPECT_EQ(asked.result.failure, "");
  EXPECT_EQ(Located(asked.result), 100);
  ASSERT_EQ(asked.result.image_turns.size(), 100U);
  EXPECT_GT(asked.result.image_turns_saved_share, ImageTurnOptions{}.begin_anew_share);
  double error = 0, turned = 0;
  for (size_t i = 20; i < 95; ++i) {
    const double half = kReadoutS / kIntervalS / 2, at = static_cast<double>(i);
    const SE3 first_row = ShakenAt(at - half, kShakingHz), last = ShakenAt(at + half, kShakingHz);
    const Eigen::Vector3d turn = (first_row * last.Inverse()).Log().tail<3>();
    const ReadoutMotion& found = asked.result.image_turns.at(asked.result.frames[i].time);
    error += (found.turn_rad - turn).squaredNorm();
    turned += turn.squaredNorm();
  }
  // The map was made without them: knowing them it is to be made anew.
  EXPECT_LT(std::sqrt(error / turned), 0.2);
  EXPECT_EQ(Bytes(asked.result), Bytes(Fly(flight, Schedule::kThreaded, options).result));
  EXPECT_TRUE(Fly(flight, Schedule::kSequential).result.image_turns.empty())
      << "few keyframes may all be bent alike";
}

TEST(SlamRollingShutter, AsksNoImagesWhereThePathKnowsBetter) {
  const SyntheticFlight flight = ReadByRows(BoxWorld(), 60, 1.5);
  EXPECT_TRUE(Fly(flight, Schedule::kSequential).result.image_turns.empty());
}

SystemOptions ThatFewKeyframesTell() {
  SystemOptions options;
  options.mapping.readout.min_keyframes = 3;
  return options;
}

TEST(SlamRollingShutter, FindsAReadoutThatNobodyTold) {
  SyntheticFlight flight = ReadByRows(BoxWorld(), 100, 1.5);
  const Outcome told = Fly(flight, Schedule::kSequential);
  flight.camera.readout_s = 0;
  SystemOptions options = ThatFewKeyframesTell();
  const Outcome found = Fly(flight, Schedule::kSequential, options);
  options.mapping.readout.enabled = false;
  const Outcome taken_for_none = Fly(flight, Schedule::kSequential, options);
  EXPECT_FALSE(told.result.readout);
  ASSERT_TRUE(found.result.readout);
  EXPECT_NEAR(found.slam->camera().readout_s, kReadoutS, 0.001);
  EXPECT_FALSE(taken_for_none.result.readout);
  EXPECT_EQ(taken_for_none.slam->camera().readout_s, 0);
  EXPECT_EQ(Located(found.result), 100);
  EXPECT_LT(ErrorOnceStarted(found.result, flight),
            0.6 * ErrorOnceStarted(taken_for_none.result, flight));
}

TEST(SlamRollingShutter, MendsAReadoutThatWasToldWrongly) {
  SyntheticFlight flight = ReadByRows(BoxWorld(), 100, 1.5);
  flight.camera.readout_s = 0.8 * kReadoutS;
  SystemOptions options = ThatFewKeyframesTell();
  const Outcome as_told = Fly(flight, Schedule::kSequential, options);
  EXPECT_FALSE(as_told.result.readout);
  EXPECT_EQ(as_told.slam->camera().readout_s, flight.camera.readout_s);
  options.mapping.readout.refine_known = true;
  const Outcome mended = Fly(flight, Schedule::kSequential, options);
  ASSERT_TRUE(mended.result.readout);
  EXPECT_NEAR(mended.slam->camera().readout_s, kReadoutS, 0.001);
  EXPECT_LT(ErrorOnceStarted(mended.result, flight), ErrorOnceStarted(as_told.result, flight));
}

/// What a gyroscope and an accelerometer in the camera measure of ShakenAt, with z up.
ImuStream SensedOn(int frames, double shaking_hz) {
  constexpr double kStepS = 0.0025;
  const auto pose_at = [&](double time_s) { return ShakenAt(time_s / kIntervalS, shaking_hz); };
  ImuStream imu;
  for (int i = 0; i * kStepS < frames * kIntervalS; ++i) {
    const double time_s = i * kStepS, half_s = kStepS / 2;
    const SE3 now = pose_at(time_s), before = pose_at(time_s - half_s);
    const SE3 after = pose_at(time_s + half_s);
    const Eigen::Vector3d acceleration =
        (after.InverseTranslation() - 2 * now.InverseTranslation() + before.InverseTranslation()) /
        (half_s * half_s);
    ImuSample sample;
    sample.time = {std::llround(1e9 * time_s)};
    sample.angular_velocity =
        RotationLog(before.rotation() * after.rotation().conjugate()) / kStepS;
    sample.specific_force = now.rotation() * (acceleration + Eigen::Vector3d(0, 0, 9.81));
    imu.samples.push_back(sample);
  }
  return imu;
}

TEST(SlamRollingShutter, FindsItByAGyroscopeWhereImagesComeTooRarely) {
  constexpr double kShakingHz = 8.3;
  SyntheticFlight flight = ReadByRows(BoxWorld(), 100, kShakingHz);
  flight.camera.readout_s = 0;
  const SystemOptions options = ThatFewKeyframesTell();
  const Outcome by_path = Fly(flight, Schedule::kSequential, options);
  EXPECT_FALSE(by_path.result.readout);
  SensorStreams streams;
  streams.imu = SensedOn(100, kShakingHz);
  const Outcome by_gyroscope =
      Fly(flight, Schedule::kSequential, options, nullptr, nullptr, -1, streams);
  ASSERT_TRUE(by_gyroscope.result.readout);
  EXPECT_NEAR(by_gyroscope.slam->camera().readout_s, kReadoutS, 0.0015);
}

TEST(SlamRollingShutter, FindsItByTheImagesWhereNothingElseTells) {
  SyntheticFlight flight = ReadByRows(BoxWorld(), 100, 8.3);
  flight.camera.readout_s = 0;
  SystemOptions options = ThatFewKeyframesTell();
  EXPECT_FALSE(Fly(flight, Schedule::kSequential, options).result.readout)
      << "few keyframes may all be bent alike";
  options.image_turns.min_keyframes = 3;
  const Outcome found = Fly(flight, Schedule::kSequential, options);
  ASSERT_TRUE(found.result.readout);
  // So few keyframes in a box tell it from 14 ms to 31, by what was assumed: a flight does better.
  EXPECT_NEAR(found.slam->camera().readout_s, kReadoutS, 0.25 * kReadoutS);
  EXPECT_EQ(found.result.image_turns.size(), 100U);
  EXPECT_GT(found.result.image_turns_saved_share, ImageTurnOptions{}.begin_anew_share);
  EXPECT_EQ(Located(found.result), 100);
}

TEST(SlamRollingShutter, NeverTakesAnAssumedReadoutForTold) {
  SyntheticFlight flight = ReadByRows(BoxWorld(), 100, 8.3);
  flight.camera.readout_s = 0;
  SystemOptions options = ThatFewKeyframesTell();
  options.image_turns.min_keyframes = 3;
  options.image_turns.untold_cost_share = 1;
  const Outcome found = Fly(flight, Schedule::kSequential, options);
  EXPECT_FALSE(found.result.readout);
  EXPECT_EQ(found.slam->camera().readout_s, 0);
  EXPECT_TRUE(found.result.image_turns.empty());
}

TEST(SlamRollingShutter, LeavesACameraThatReadsAllRowsAtOnce) {
  for (const double shaking_hz : {1.5, 8.3}) {
    const SyntheticFlight flight = ReadByRows(BoxWorld(), 100, shaking_hz, 0);
    SystemOptions options = ThatFewKeyframesTell();
    options.image_turns.min_keyframes = 3;
    const Outcome searched = Fly(flight, Schedule::kSequential, options);
    EXPECT_FALSE(searched.result.readout);
    EXPECT_TRUE(searched.result.image_turns.empty());
    options.mapping.readout.enabled = false;
    EXPECT_EQ(Bytes(searched.result), Bytes(Fly(flight, Schedule::kSequential, options).result));
  }
}

TEST(SlamRollingShutter, FindsTheSameReadoutSequentialAndThreaded) {
  SyntheticFlight flight = ReadByRows(BoxWorld(), 60, 1.5);
  flight.camera.readout_s = 0;
  const SystemOptions options = ThatFewKeyframesTell();
  const Outcome sequential = Fly(flight, Schedule::kSequential, options);
  ASSERT_TRUE(sequential.result.readout);
  EXPECT_EQ(Bytes(sequential.result), Bytes(Fly(flight, Schedule::kThreaded, options).result));
}

TEST(SlamRollingShutter, IsTheSameSequentialAndThreaded) {
  const SyntheticFlight flight = ReadByRows(BoxWorld(), 60, 2);
  EXPECT_EQ(Bytes(Fly(flight, Schedule::kSequential).result),
            Bytes(Fly(flight, Schedule::kThreaded).result));
}

}  // namespace
}  // namespace deepuav
