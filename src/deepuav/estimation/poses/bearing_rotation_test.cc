#include "deepuav/estimation/poses/bearing_rotation.h"

#include <gtest/gtest.h>

#include <limits>

#include "support/synthetic_world.h"

namespace deepuav {
namespace {

constexpr Pinhole kPinhole{450, 450, 376, 240};
const Eigen::Quaterniond kTurn = RotationExp({0.05, 0.3, -0.1});

/// What two cameras at one place see, the pixels of a share of it wrong.
std::vector<PixelPair> Pairs(int count, double wrong_share) {
  Random random(1);
  std::vector<PixelPair> pairs;
  while (static_cast<int>(pairs.size()) < count) {
    const Eigen::Vector2d a_px(random.Uniform(0, 752), random.Uniform(0, 480));
    const Eigen::Vector3d seen = kTurn * kPinhole.Unproject(a_px);
    if (seen.z() < 0.1) continue;
    Eigen::Vector2d b_px = kPinhole.Project(seen);
    b_px += Eigen::Vector2d(random.Gaussian(0.5), random.Gaussian(0.5));
    if (random.Uniform(0, 1) < wrong_share) b_px = {random.Uniform(0, 752), random.Uniform(0, 480)};
    pairs.push_back({a_px, b_px});
  }
  return pairs;
}

double ErrorOf(const BearingRotation& found) {
  return RotationLog(found.b_from_a * kTurn.conjugate()).norm();
}

TEST(BearingRotation, IsFoundAmongWrongPairs) {
  const auto found = EstimateBearingRotation(kPinhole, Pairs(300, 0.5), 3, 200, 1);
  ASSERT_TRUE(found);
  EXPECT_LT(ErrorOf(*found), 0.001);
  EXPECT_GT(found->inlier_count, 130);
  EXPECT_LT(found->inlier_count, 165);
}

TEST(BearingRotation, FollowsFromTwoPairs) {
  const auto found = EstimateBearingRotation(kPinhole, Pairs(2, 0), 3, 20, 1);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->inlier_count, 2);
  EXPECT_LT(ErrorOf(*found), 0.02);
}

TEST(BearingRotation, NeedsTwoPairs) {
  EXPECT_FALSE(EstimateBearingRotation(kPinhole, {}, 3, 200, 1));
  EXPECT_FALSE(EstimateBearingRotation(kPinhole, Pairs(1, 0), 3, 200, 1));
}

TEST(BearingRotation, IsFoundUpToAHighShareOfWrongPairs) {
  for (const double wrong_share : {0.0, 0.3, 0.6, 0.75}) {
    const std::vector<PixelPair> pairs = Pairs(400, wrong_share);
    const auto found = EstimateBearingRotation(kPinhole, pairs, 3, 300, 5);
    ASSERT_TRUE(found) << wrong_share;
    EXPECT_LT(ErrorOf(*found), 0.002) << wrong_share;
    int agreeing = 0;
    for (size_t i = 0; i < pairs.size(); ++i) {
      const Eigen::Vector3d turned =
          found->b_from_a * kPinhole.Unproject(pairs[i].a_px).normalized();
      const double chord = (turned - kPinhole.Unproject(pairs[i].b_px).normalized()).norm();
      EXPECT_EQ(found->inlier[i] != 0, chord <= 3 / 450.0) << i;
      agreeing += found->inlier[i];
    }
    EXPECT_EQ(found->inlier_count, agreeing);
  }
}

TEST(BearingRotation, FollowsFromItsArgumentsAlone) {
  const std::vector<PixelPair> pairs = Pairs(200, 0.6);
  const auto one = EstimateBearingRotation(kPinhole, pairs, 3, 50, 9),
             again = EstimateBearingRotation(kPinhole, pairs, 3, 50, 9);
  ASSERT_TRUE(one && again);
  EXPECT_EQ(one->b_from_a.coeffs(), again->b_from_a.coeffs());
  EXPECT_EQ(one->inlier, again->inlier);
}

TEST(BearingRotation, OfPairsAtOnePlaceIsARotationThatTakesThemThere) {
  const std::vector<PixelPair> pairs(30, Pairs(1, 0).front());
  const auto found = EstimateBearingRotation(kPinhole, pairs, 3, 50, 1);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->b_from_a.norm(), 1, 1e-9);
  EXPECT_EQ(found->inlier_count, 30);
}

TEST(BearingRotation, PixelsThatAreNoneAgreeWithNothingAndHarmNothing) {
  std::vector<PixelPair> pairs = Pairs(200, 0.2);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (size_t i = 0; i < pairs.size(); i += 4) pairs[i].b_px = {nan, 5};
  const auto found = EstimateBearingRotation(kPinhole, pairs, 3, 300, 2);
  ASSERT_TRUE(found);
  EXPECT_LT(ErrorOf(*found), 0.002);
  for (size_t i = 0; i < pairs.size(); i += 4) EXPECT_FALSE(found->inlier[i]);
  for (PixelPair& pair : pairs) pair.a_px.x() = nan;
  EXPECT_FALSE(EstimateBearingRotation(kPinhole, pairs, 3, 300, 2));
}

TEST(BearingRotation, OfNoIterationsIsNone) {
  EXPECT_FALSE(EstimateBearingRotation(kPinhole, Pairs(50, 0), 3, 0, 1));
}

}  // namespace
}  // namespace deepuav
