#include "deepuav/estimation/paths/smooth_motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/random.h"
#include "support/numeric_jacobian.h"

namespace deepuav {
namespace {

MovingCamera Somewhere() {
  MovingCamera camera(SE3::Exp((Vector6d() << 1, -2, 0.5, 0.3, -0.8, 0.4).finished()));
  camera.velocity_world_per_s = {0.3, -0.1, 0.2};
  camera.turn_cam_rad_per_s = {0.5, 2, -0.4};
  return camera;
}

/// Where the camera comes at a steady pace.
MovingCamera After(const MovingCamera& camera, double seconds) {
  MovingCameraStep step = MovingCameraStep::Zero();
  step.segment<3>(kCentreAt) = seconds * camera.velocity_world_per_s;
  step.segment<3>(kOrientationAt) = seconds * camera.turn_cam_rad_per_s;
  return Moved(camera, step);
}

TEST(SmoothMotion, ASteadyPaceIsNoError) {
  const MovingCamera camera = Somewhere();
  EXPECT_LT(SmoothMotionError(camera, After(camera, 0.3), 0.3, {0.5, 2}).norm(), 1e-9);
}

TEST(SmoothMotion, JacobiansEqualCentralDifferences) {
  const MovingCamera first = Somewhere();
  MovingCameraStep apart;
  apart << 0.1, 0.2, -0.3, 0.3, -0.5, 0.2, 0.1, 0.4, 0.2, -0.3, 0.6, 0.2;
  const MovingCamera second = Moved(After(first, 0.2), apart);
  const MotionNoise noise{0.5, 2};
  MovingCameraMatrix by_first, by_second;
  SmoothMotionError(first, second, 0.2, noise, &by_first, &by_second);
  const auto of_first = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return SmoothMotionError(Moved(first, d), second, 0.2, noise);
  };
  const auto of_second = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return SmoothMotionError(first, Moved(second, d), 0.2, noise);
  };
  EXPECT_LT((by_first - NumericJacobian(of_first, kMovingCameraSize)).norm(), 1e-5);
  EXPECT_LT((by_second - NumericJacobian(of_second, kMovingCameraSize)).norm(), 1e-5);
}

/// A camera that white noise accelerates, seen every tenth of a second.
Trajectory NoisyPath(const MotionNoise& noise, int poses) {
  constexpr int kStepsAPose = 20;
  constexpr double kStep_s = 0.1 / kStepsAPose;
  Random random(1);
  const auto kick = [&](double density) {
    const double sigma = std::sqrt(density * kStep_s);
    return Eigen::Vector3d(random.Gaussian(sigma), random.Gaussian(sigma), random.Gaussian(sigma));
  };
  Trajectory path;
  MovingCamera camera;
  for (int i = 0; i < poses; ++i) {
    path.push_back({Timestamp{i * int64_t{100'000'000}}, camera.CamFromWorld().Inverse()});
    for (int step = 0; step < kStepsAPose; ++step) {
      camera.velocity_world_per_s += kick(noise.travel);
      camera.turn_cam_rad_per_s += kick(noise.turn);
      camera = After(camera, kStep_s);
    }
  }
  return path;
}

TEST(SmoothMotion, APathShowsTheNoiseThatMadeIt) {
  const MotionNoise noise{0.3, 0.02};
  const MotionNoise measured = MeasureMotionNoise(NoisyPath(noise, 2000), 0.15, 10);
  EXPECT_NEAR(measured.travel, noise.travel, 0.1 * noise.travel);
  EXPECT_NEAR(measured.turn, noise.turn, 0.1 * noise.turn);
}

TEST(SmoothMotion, LongStepsAndShortPathsTellNothing) {
  const Trajectory path = NoisyPath({0.3, 0.02}, 20);
  EXPECT_TRUE(MeasureMotionNoise(path, 0.15, 10).usable());
  EXPECT_FALSE(MeasureMotionNoise(path, 0.05, 10).usable());
  EXPECT_FALSE(MeasureMotionNoise(path, 0.15, 19).usable());
  EXPECT_FALSE(MeasureMotionNoise({}, 0.15, 1).usable());
}

}  // namespace
}  // namespace deepuav
