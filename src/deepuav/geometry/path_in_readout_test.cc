#include "deepuav/geometry/path_in_readout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

constexpr double kReadoutS = 0.02;

/// A camera that shakes about all axes at a frequency while it flies a curve.
SE3 WorldFromCam(double t, double hz) {
  const double phase = 2 * std::numbers::pi * hz * t;
  const Eigen::Vector3d shaken =
      0.02 * Eigen::Vector3d(std::sin(phase), std::cos(1.1 * phase), std::sin(0.9 * phase + 1));
  return SE3(RotationExp({0, 0, 0.3 * t}) * RotationExp(shaken),
             {3 * t, 0.4 * t * t, 0.1 * std::sin(2 * t)});
}

Timestamp At(double t) { return {static_cast<int64_t>(std::llround(1e9 * (100 + t)))}; }

/// Every `step_s`, each second one half of `uneven_s` late.
Trajectory Path(double hz, double step_s, double uneven_s = 0) {
  Trajectory path;
  for (int i = 0; i < 80; ++i) {
    const double t = i * step_s + (i % 2 == 0 ? 0 : uneven_s);
    path.push_back({At(t), WorldFromCam(t, hz)});
  }
  return path;
}

/// What the rows read at a moment see more than the middle row's: of the turn and of the travel.
double ErrorOf(const ReadoutMotion& motion, double t, double hz) {
  double error = 0;
  for (const double moment : {-0.5, -0.25, 0.25, 0.5}) {
    const SE3 middle_from_row =
        WorldFromCam(t, hz).Inverse() * WorldFromCam(t + moment * kReadoutS, hz);
    error = std::max(error, (middle_from_row.Log().tail<3>() - motion.TurnAt(moment)).norm());
    error = std::max(error, (middle_from_row.translation() - moment * motion.travel).norm());
  }
  return error;
}

TEST(PathInReadout, TellsTurnItsBendAndTravel) {
  for (const double uneven_s : {0.0, 0.01}) {
    const Trajectory path = Path(2, 0.05, uneven_s);
    for (const size_t at : {20UL, 41UL}) {
      const double t = SecondsBetween(At(0), path[at].time);
      const auto motion = MotionOnPath(path, at, kReadoutS, {});
      ASSERT_TRUE(motion);
      EXPECT_GT(ErrorOf({}, t, 2), 2e-3);
      EXPECT_LT(ErrorOf(*motion, t, 2), 1e-4);
    }
  }
}

TEST(PathInReadout, IsBetterThanGoingOnAsBefore) {
  const Trajectory path = Path(4, 0.05);
  double before = 0, about = 0;
  for (size_t at = 10; at < 70; ++at) {
    const double t = SecondsBetween(At(0), path[at].time);
    const auto goes_on = MotionInReadout(path[at - 1].world_from_cam.Inverse(),
                                         path[at].world_from_cam.Inverse(), 0.05, kReadoutS);
    before += std::pow(ErrorOf(goes_on, t, 4), 2);
    about += std::pow(ErrorOf(*MotionOnPath(path, at, kReadoutS, {}), t, 4), 2);
  }
  EXPECT_LT(about, 0.01 * before);
}

TEST(PathInReadout, TellsLessAtTheEnds) {
  Trajectory path = Path(1, 0.05);
  const auto error_at = [&](size_t at) {
    const auto motion = MotionOnPath(path, at, kReadoutS, {});
    return motion ? ErrorOf(*motion, SecondsBetween(At(0), path[at].time), 1) : -1;
  };
  const double rest = ErrorOf({}, 0, 1);
  for (const size_t end : {size_t{0}, path.size() - 1}) EXPECT_LT(error_at(end), 0.2 * rest);
  EXPECT_LT(error_at(1), 0.03 * rest);
  // Two stretches, of which one is too short.
  path.resize(32);
  const size_t gap = 30;
  for (size_t i = gap; i < path.size(); ++i) path[i].time.nanoseconds += 1'000'000'000;
  EXPECT_LT(error_at(gap - 1), 0.2 * rest);
  EXPECT_FALSE(MotionOnPath(path, gap, kReadoutS, {}));
  EXPECT_FALSE(MotionOnPath(path, gap + 1, kReadoutS, {}));
}

TEST(PathInReadout, TellsNothingByAPoseOfTheSameTime) {
  Trajectory path = Path(1, 0.05);
  path[21].time = path[20].time;
  path.resize(22);
  EXPECT_TRUE(MotionOnPath(path, 20, kReadoutS, {})->turn_rad.allFinite());
  EXPECT_FALSE(MotionOnPath(path, 21, kReadoutS, {}));
  EXPECT_TRUE(std::isfinite(TurnsMissed(path, {})->share()));
}

TEST(PathInReadout, SaysWhereImagesComeTooRarely) {
  Trajectory path = Path(1, 0.05);
  const double steady = TurnsMissed(path, {})->share();
  Random random(1);
  for (TimedPose& pose : path) {
    const Eigen::Vector3d shake(random.Gaussian(0.02), random.Gaussian(0.02),
                                random.Gaussian(0.02));
    pose.world_from_cam = pose.world_from_cam * SE3(RotationExp(shake), Eigen::Vector3d::Zero());
  }
  const MissedTurns shaking = *TurnsMissed(path, {});
  EXPECT_LT(steady, 0.1);
  EXPECT_GT(shaking.share(), 0.75);
  EXPECT_GT(shaking.missed_rad, 0.02);
}

TEST(PathInReadout, SaysNothingOfTooFewPosesAndOfACameraAtRest) {
  EXPECT_FALSE(TurnsMissed({}, {}));
  Trajectory path = Path(2, 0.05);
  path.resize(2);
  EXPECT_FALSE(TurnsMissed(path, {}));
  Trajectory at_rest = Path(2, 0.05);
  for (TimedPose& pose : at_rest) pose.world_from_cam = SE3();
  EXPECT_EQ(TurnsMissed(at_rest, {})->share(), 0);
  EXPECT_TRUE(MotionOnPath(at_rest, 20, kReadoutS, {})->turn_rad.isZero(0));
}

}  // namespace
}  // namespace deepuav
