#include "deepuav/estimation/bearing_rotation.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace deepuav
