#include "deepuav/tracking/motion_model.h"

#include <gtest/gtest.h>

#include <cmath>

namespace deepuav {
namespace {

Timestamp Seconds(double seconds) { return {static_cast<int64_t>(seconds * 1e9)}; }

SE3 At(double x, double turn = 0) { return SE3(RotationExp({0, turn, 0}), {x, 0, 0}); }

double Difference(const SE3& a, const SE3& b) { return (a * b.Inverse()).Log().norm(); }

TEST(MotionModel, KnowsNothingBeforeTheFirstPose) {
  MotionModel model;
  EXPECT_FALSE(model.Predict(Seconds(1)));
  model.Correct(At(1));
  EXPECT_FALSE(model.Predict(Seconds(1))) << "there was no pose to correct";
}

TEST(MotionModel, PredictsTheOnlyPoseItKnows) {
  MotionModel model;
  model.Update(Seconds(1), At(3));
  EXPECT_LT(Difference(*model.Predict(Seconds(5)), At(3)), 1e-12);
}

TEST(MotionModel, GoesOnWithTheSameVelocityOverAnyTime) {
  MotionModel model;
  const SE3 step = SE3::Exp((Vector6d() << 0.3, -0.1, 0.2, 0.02, 0.05, -0.01).finished());
  const SE3 start = SE3(RotationExp({0.3, 0.2, 0.1}), {5, 6, 7});
  model.Update(Seconds(10.0), start);
  model.Update(Seconds(10.1), step * start);
  EXPECT_LT(Difference(*model.Predict(Seconds(10.2)), step * step * start), 1e-9);
  EXPECT_LT(Difference(*model.Predict(Seconds(10.3)), step * step * step * start), 1e-9);
  EXPECT_LT(Difference(*model.Predict(Seconds(10.1)), step * start), 1e-9);
  const SE3 half = SE3::Exp(0.5 * step.Log());
  EXPECT_LT(Difference(*model.Predict(Seconds(10.15)), half * step * start), 1e-9);
}

TEST(MotionModel, ACorrectionMovesThePoseAndKeepsTheVelocity) {
  MotionModel model;
  model.Update(Seconds(1), At(0));
  model.Update(Seconds(2), At(1));
  model.Correct(At(11));
  EXPECT_LT(Difference(*model.Predict(Seconds(3)), At(12)), 1e-9);
  model.Update(Seconds(3), At(12));
  EXPECT_LT(Difference(*model.Predict(Seconds(4)), At(13)), 1e-9);
}

TEST(MotionModel, TimeThatStandsStillGivesNoVelocity) {
  MotionModel model;
  model.Update(Seconds(1), At(0));
  model.Update(Seconds(1), At(1));
  EXPECT_LT(Difference(*model.Predict(Seconds(2)), At(1)), 1e-12);
}

TEST(MotionModel, ForgetsOnReset) {
  MotionModel model;
  model.Update(Seconds(1), At(0));
  model.Update(Seconds(2), At(1));
  model.Reset();
  EXPECT_FALSE(model.Predict(Seconds(3)));
  model.Correct(At(1));
  model.Update(Seconds(3), At(5));
  EXPECT_LT(Difference(*model.Predict(Seconds(4)), At(5)), 1e-12) << "one pose has no velocity";
}

/// A camera that swings about its y axis and moves steadily, and a gyroscope on it.
class SwingingCamera {
 public:
  static constexpr double kStepS = 0.1;

  explicit SwingingCamera(double bias_rad_s = 0, double gain = 1)
      : bias_rad_s_(bias_rad_s), gain_(gain) {}

  SE3 PoseAt(int step) const {
    const Eigen::Quaterniond rotation = RotationExp({0, AngleAt(step), 0});
    return SE3(rotation, -(rotation * Eigen::Vector3d(0.5 * step * kStepS, 0, 0)));
  }
  Eigen::Quaterniond TurnTo(int step) const {
    const double turn = AngleAt(step) - AngleAt(step - 1);
    return RotationExp({bias_rad_s_ * kStepS, gain_ * turn, 0});
  }
  /// Tracks the frames from `first` on.
  void Track(int first, int count, MotionModel* model) const {
    for (int step = first; step < first + count; ++step) {
      model->Turn(Seconds(step * kStepS), TurnTo(step));
      model->Update(Seconds(step * kStepS), PoseAt(step));
    }
  }
  SE3 Predicted(int step, MotionModel* model) const {
    model->Turn(Seconds(step * kStepS), TurnTo(step));
    return *model->Predict(Seconds(step * kStepS));
  }

 private:
  double AngleAt(int step) const { return 0.4 * std::sin(7.0 * step * kStepS); }

  const double bias_rad_s_, gain_;
};

TEST(MotionModel, TurnsAsAGyroscopeSays) {
  MotionModel with, without;
  const SwingingCamera camera;
  camera.Track(0, 20, &with);
  for (int step = 18; step < 20; ++step)
    without.Update(Seconds(step * SwingingCamera::kStepS), camera.PoseAt(step));
  EXPECT_LT(Difference(camera.Predicted(20, &with), camera.PoseAt(20)), 1e-9);
  EXPECT_GT(Difference(*without.Predict(Seconds(2)), camera.PoseAt(20)), 0.05);
}

TEST(MotionModel, LearnsAGyroscopesBias) {
  MotionModel model;
  const SwingingCamera camera(0.1);
  camera.Track(0, 3, &model);
  for (int step = 3; step < 30; ++step) {
    EXPECT_LT(Difference(camera.Predicted(step, &model), camera.PoseAt(step)), 2e-3) << step;
    model.Update(Seconds(step * SwingingCamera::kStepS), camera.PoseAt(step));
  }
}

TEST(MotionModel, AWrongPoseDoesNotSpoilWhatIsKnownOfTheGyroscope) {
  MotionModel model;
  const SwingingCamera camera(0.05);
  camera.Track(0, 40, &model);
  model.Turn(Seconds(4), camera.TurnTo(40));
  model.Update(Seconds(4),
               SE3(RotationExp({1, 0, 2}), Eigen::Vector3d::Zero()) * camera.PoseAt(40));
  camera.Track(41, 30, &model);
  EXPECT_LT(Difference(camera.Predicted(71, &model), camera.PoseAt(71)), 2e-3);
}

TEST(MotionModel, DoesNotFollowAGyroscopeThatIsUpsideDown) {
  MotionModel with, without;
  const SwingingCamera camera(0, -1);
  camera.Track(0, 20, &with);
  for (int step = 18; step < 20; ++step)
    without.Update(Seconds(step * SwingingCamera::kStepS), camera.PoseAt(step));
  EXPECT_LT(Difference(camera.Predicted(20, &with), *without.Predict(Seconds(2))), 1e-12);
}

TEST(MotionModel, AGyroscopeCarriesTheLastPoseOnOverLostFrames) {
  MotionModel model;
  const SwingingCamera camera(0.05);
  camera.Track(0, 20, &model);
  for (int step = 20; step < 26; ++step) {
    model.Turn(Seconds(step * SwingingCamera::kStepS), camera.TurnTo(step));
    model.Lose();
  }
  EXPECT_TRUE(model.is_lost());
  EXPECT_LT(Difference(camera.Predicted(26, &model), camera.PoseAt(26)), 5e-3);
  model.Update(Seconds(2.6), camera.PoseAt(26));
  EXPECT_FALSE(model.is_lost());
  EXPECT_LT(Difference(*model.Predict(Seconds(2.7)), camera.PoseAt(26)), 1e-12)
      << "the velocity of before the gap is none";
}

TEST(MotionModel, NothingIsPredictedOverLostFramesWithoutAllTurns) {
  MotionModel model;
  const SwingingCamera camera;
  camera.Track(0, 20, &model);
  model.Turn(Seconds(2), std::nullopt);
  EXPECT_TRUE(model.Predict(Seconds(2))) << "by constant velocity";
  model.Lose();
  EXPECT_FALSE(model.Predict(Seconds(2)));
  model.Turn(Seconds(2.1), camera.TurnTo(21));
  EXPECT_FALSE(model.Predict(Seconds(2.1)));
}

TEST(MotionModel, AFrameThatCameTwiceTurnedOnce) {
  MotionModel model;
  const SwingingCamera camera;
  camera.Track(0, 20, &model);
  const SE3 once = camera.Predicted(20, &model);
  EXPECT_LT(Difference(camera.Predicted(20, &model), once), 1e-15);
}

}  // namespace
}  // namespace deepuav
