#include "deepuav/tracking/motion_model.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace deepuav
