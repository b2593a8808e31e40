#include "deepuav/simulation/flight/route.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using Points = std::vector<FlatOutput>;

constexpr double kPi = std::numbers::pi;

double Distance(const FlatOutput& a, const FlatOutput& b) { return (a - b).head<3>().norm(); }

Points RightAngle() { return {{0, 0, 10, 0}, {30, 0, 10, 0}, {30, 20, 14, kPi / 2}}; }

TEST(Resample, PutsPointsAStepApartOnTheSameLine) {
  const Points points = Resample(RightAngle(), 1.5);
  EXPECT_EQ(points.front(), RightAngle().front());
  EXPECT_LT((points.back() - RightAngle().back()).norm(), 1e-12);
  double length = 0;
  for (size_t i = 1; i < points.size(); ++i) {
    const double step = Distance(points[i], points[i - 1]);
    EXPECT_LE(step, 1.5 + 1e-12);
    EXPECT_GT(step, 0.75);
    length += step;
  }
  EXPECT_NEAR(length, 30 + std::hypot(20, 4), 1e-9);
}

TEST(Resample, TurnsTheShorterWayAndNeverJumps) {
  const Points points = Resample({{0, 0, 0, 3}, {10, 0, 0, -3}, {20, 0, 0, 3 + 4 * kPi}}, 1);
  for (size_t i = 1; i < points.size(); ++i)
    EXPECT_LT(std::abs(points[i].w() - points[i - 1].w()), 0.05);
  EXPECT_NEAR(points[10].w(), 2 * kPi - 3, 1e-12);
  EXPECT_NEAR(points.back().w(), 3, 1e-12);
}

TEST(Resample, LeavesNothingOfALineWithoutLengthButItsEnd) {
  const FlatOutput here(1, 2, 3, 0.5);
  for (const Points& points : {Points{here}, Points{here, here}, Points(5, here)}) {
    const Points left = Resample(points, 1);
    ASSERT_EQ(left.size(), 1u);
    EXPECT_EQ(left[0], here);
  }
  // The last heading counts.
  FlatOutput turned = here;
  turned.w() = 0.8;
  EXPECT_NEAR(Resample({here, turned}, 1)[0].w(), 0.8, 1e-12);
}

TEST(Smooth, KeepsEndsAndStraightLinesAndRoundsCorners) {
  const Points straight = Resample({{0, 0, 5, 1}, {40, 10, 5, 1}}, 1);
  const Points same = Smooth(straight, 1, 12);
  ASSERT_EQ(same.size(), straight.size());
  for (size_t i = 0; i < same.size(); ++i) EXPECT_LT((same[i] - straight[i]).norm(), 1e-9);

  const Points corner = Resample(RightAngle(), 1), round = Smooth(corner, 1, 12);
  EXPECT_LT((round.front() - corner.front()).norm(), 1e-12);
  EXPECT_LT((round.back() - corner.back()).norm(), 1e-12);
  const auto sharpest = [](const Points& points) {
    double most = 0;
    for (size_t i = 1; i + 1 < points.size(); ++i) {
      const Eigen::Vector3d before = (points[i] - points[i - 1]).head<3>().normalized(),
                            after = (points[i + 1] - points[i]).head<3>().normalized();
      most = std::max(most, std::acos(std::min(1.0, before.dot(after))));
    }
    return most;
  };
  EXPECT_GT(sharpest(corner), 1.5);
  EXPECT_LT(sharpest(round), 0.5);
  EXPECT_EQ(Smooth({RightAngle()[0]}, 1, 12).size(), 1u);
}

/// Curves join in place and heading, at rest, and stay within the limits.
void ExpectFlyable(const std::vector<MinimumSnapCurve>& curves, const MotionLimits& limits) {
  FlatOutput end = curves.front().At(0).value;
  for (const MinimumSnapCurve& curve : curves) {
    EXPECT_LT((curve.At(0).value - end).norm(), 1e-6);
    for (double t = 0; t <= curve.end_s(); t += 0.02) {
      const FlatState state = curve.At(t);
      ASSERT_LT(state.velocity.head<3>().norm(), 1.01 * limits.speed_m_s);
      ASSERT_LT(state.acceleration.head<3>().norm(), 1.02 * limits.acceleration_m_s2);
      ASSERT_LT(std::abs(state.velocity.w()), 1.01 * limits.yaw_rate_rad_s);
    }
    const FlatState stop = curve.At(curve.end_s());
    EXPECT_LT(stop.velocity.norm(), 1e-6);
    end = stop.value;
  }
}

TEST(FlyLegsTest, JoinLegsWithoutAJumpOfPlaceOrHeading) {
  const MotionLimits limits{8, 3, 1.2};
  const Leg there{Resample({{0, 0, 10, 0}, {40, 0, 10, 0}}, 1), 2, 0.75 * kPi};
  // It begins where the other ended, with another heading, a whole turn further on.
  const Leg back{Resample({{40, 0, 10, 2 * kPi + kPi}, {0, 5, 10, 2 * kPi + kPi}}, 1), 0, 0};
  const auto curves = FlyLegs({there, back}, limits);
  ExpectFlyable(curves, limits);
  // There, the pause, the turn, the quarter of pi that is left, and back.
  ASSERT_EQ(curves.size(), 5u);
  EXPECT_NEAR(curves[1].end_s(), 2, 1e-9);
  const double turned = curves[2].At(curves[2].end_s()).value.w();
  EXPECT_NEAR(turned, 0.75 * kPi, 1e-9);
  EXPECT_NEAR(curves[4].At(curves[4].end_s()).value.w(), kPi, 1e-9);
}

TEST(FlyLegsTest, TurnByMoreThanOnceRoundWhereAsked) {
  const MotionLimits limits{8, 3, 2};
  const Leg leg{Resample({{0, 0, 10, 0}, {9, 0, 10, 0}}, 1), 0, -5 * kPi};
  const auto curves = FlyLegs({leg}, limits);
  ExpectFlyable(curves, limits);
  EXPECT_NEAR(curves.back().At(curves.back().end_s()).value.w(), -5 * kPi, 1e-9);
  EXPECT_GT(curves.back().end_s(), 5 * kPi / 2);
}

TEST(FlyAlongTest, ASharpBendIsTakenSlowly) {
  const MotionLimits limits{15, 2, 10};
  const auto curves = FlyAlong(Smooth(Resample(RightAngle(), 1), 1, 8), limits);
  ASSERT_EQ(curves.size(), 1u);
  ExpectFlyable(curves, limits);
  double fastest = 0, at_corner = 1e9;
  for (double t = 0; t < curves[0].end_s(); t += 0.05) {
    const FlatState state = curves[0].At(t);
    const double speed = state.velocity.head<3>().norm();
    fastest = std::max(fastest, speed);
    if (Distance(state.value, RightAngle()[1]) < 3) at_corner = std::min(at_corner, speed);
  }
  EXPECT_GT(fastest, 5);
  EXPECT_LT(at_corner, 0.7 * fastest);
}

TEST(FlyAlongTest, LeadsNowhereWithoutPointsAndRefusesHours) {
  EXPECT_TRUE(FlyAlong({}, {}).empty());
  EXPECT_TRUE(FlyAlong({RightAngle()[0]}, {}).empty());
  EXPECT_TRUE(TurnOnTheSpot(RightAngle()[0], 0, {}).empty());
  MotionLimits slow;
  slow.speed_m_s = 0.1;
  EXPECT_THROW(FlyAlong(Resample({{0, 0, 0, 0}, {500, 0, 0, 0}}, 1), slow), Error);
}

}  // namespace
}  // namespace deepuav
