#include "deepuav/looping/turns_to_try.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "deepuav/base/error.h"
#include "deepuav/geometry/se3.h"
#include "support/options_with.h"
#include "support/synthetic_world.h"

namespace deepuav {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// `pose`, its camera turned by the rotation vector (of its own axes).
SE3 Turned(const SE3& pose, const Eigen::Vector3d& turn_rad) {
  return SE3(RotationExp(turn_rad), Eigen::Vector3d::Zero()) * pose;
}

QuarterTurns Of(double heading_deg, const TurnsToTryOptions& options = {}) {
  return TurnsToTry(LookDown({0, 0, 10}, 0), LookDown({3, 1, 12}, heading_deg * kDegree), options);
}

QuarterTurns Reversed(const QuarterTurns& turns) { return {turns[2], turns[1], turns[0]}; }

TEST(TurnsToTry, TurnsTheImageAsThePlaceSawIt) {
  constexpr int kSide = 101;
  const Eigen::Vector2d centre(50, 50);
  const SE3 camera = LookDown({0, 0, 10}, 0.3);
  const Eigen::Vector3d landmark = camera.Inverse() * Eigen::Vector3d(2, 1, 9);
  const auto seen_px = [&](const SE3& pose) -> Eigen::Vector2f {
    return (100 * (pose * landmark).hnormalized() + centre).cast<float>();
  };
  for (int quarter_turns = 1; quarter_turns < 4; ++quarter_turns) {
    const SE3 place = Turned(camera, {0, 0, 90 * kDegree * quarter_turns});
    ASSERT_LT((TurnPixel(seen_px(camera), quarter_turns, kSide, kSide) - seen_px(place)).norm(),
              1e-3);
    QuarterTurns expected = {};
    expected[static_cast<size_t>(quarter_turns - 1)] = true;
    EXPECT_EQ(TurnsToTry(camera, place, {}), expected) << quarter_turns;
    EXPECT_EQ(TurnsToTry(place, camera, {}), Reversed(expected)) << quarter_turns;
  }
}

TEST(TurnsToTry, TriesNothingWhereUprightDoes) {
  for (double heading_deg : {0.0, 10.0, -29.0, 29.0}) EXPECT_EQ(Of(heading_deg), QuarterTurns{});
}

TEST(TurnsToTry, TriesBothHeadingsBetweenTwo) {
  const QuarterTurns one = Of(45), two = Of(135);
  EXPECT_EQ(std::count(one.begin(), one.end(), true), 1) << "the other is upright";
  EXPECT_EQ(std::count(two.begin(), two.end(), true), 2);
  EXPECT_EQ(Of(-45), Reversed(one));
  EXPECT_EQ(Of(-135), Reversed(two));
  EXPECT_EQ(Of(135 + 720), two);
}

TEST(TurnsToTry, LooksForNoPlaceSeenInAnotherDirection) {
  const SE3 camera = LookDown({0, 0, 10}, 0);
  const SE3 back = Turned(camera, {0, 0, 180 * kDegree});
  EXPECT_EQ(TurnsToTry(camera, Turned(back, {70 * kDegree, 0, 0}), {}),
            (QuarterTurns{false, true, false}));
  EXPECT_EQ(TurnsToTry(camera, Turned(back, {80 * kDegree, 0, 0}), {}), QuarterTurns{});
  EXPECT_EQ(TurnsToTry(camera, Turned(camera, {0, 180 * kDegree, 0}), {}), QuarterTurns{})
      << "it looks back";
}

TEST(TurnsToTry, TellsWhatItsOptionsMean) {
  EXPECT_EQ(Of(20, OptionsWith(&TurnsToTryOptions::max_turn_deg, 180.0)), kAllTurns);
  EXPECT_THROW(OptionsWith(&TurnsToTryOptions::max_turn_deg, 40.0).Check(), Error);
  EXPECT_THROW(OptionsWith(&TurnsToTryOptions::max_angle_deg, -1.0).Check(), Error);
}

}  // namespace
}  // namespace deepuav
