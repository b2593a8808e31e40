#include "deepuav/estimation/two_views/two_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/estimation/testing/two_view_errors.h"
#include "support/estimation_problems.h"

namespace deepuav {
namespace {

SyntheticWorld BoxWorld(uint64_t seed, int landmarks) {
  Random random(seed);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(landmarks, {-8, -5, 5}, {8, 5, 18}, &random);
  return world;
}

void ExpectPointsMatch(const SyntheticWorld& world, const SyntheticPairs& pairs,
                       const SE3& a_from_world, double true_baseline,
                       const TwoViewSolution& solution, double relative_error) {
  std::vector<double> errors;
  for (size_t i = 0; i < pairs.pairs.size(); ++i) {
    if (!solution.valid[i] || pairs.outlier[i]) continue;
    const Eigen::Vector3d truth =
        a_from_world * world.landmarks_world[pairs.landmark[i]] / true_baseline;
    errors.push_back((solution.points_a[i] - truth).norm() / truth.norm());
  }
  ASSERT_GT(errors.size(), 20u);
  std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
  EXPECT_LT(errors[errors.size() / 2], relative_error);
}

TEST(EstimateTwoView, ExactForAGeneralSceneWithoutNoise) {
  const SyntheticWorld world = BoxWorld(1, 300);
  Random random(2);
  for (int i = 0; i < 10; ++i) {
    const SE3 b_from_a = Perturbed(SE3(), 1, 0.1, &random);
    const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {}, &random);
    const auto result = EstimateTwoView(world.pinhole, seen.pairs, 3, {});
    ASSERT_TRUE(result) << b_from_a.translation().transpose();
    ASSERT_EQ(result->solutions.size(), 1u);
    EXPECT_LT(BestErrorDeg(*result, b_from_a), 1e-3);
    EXPECT_NEAR(result->solutions[0].b_from_a.translation().norm(), 1, 1e-12);
    ExpectPointsMatch(world, seen, SE3(), 1, result->solutions[0], 1e-4);
  }
}

TEST(EstimateTwoView, GeneralSceneWithNoiseAndOutliers) {
  const SyntheticWorld world = BoxWorld(3, 500);
  Random random(4);
  for (int i = 0; i < 10; ++i) {
    Eigen::Vector3d sideways(random.Uniform(-1, 1), random.Uniform(-1, 1),
                             random.Uniform(-0.3, 0.3));
    const SE3 b_from_a(RotationExp(0.1 * RandomDirection(&random)), sideways.normalized());
    const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {1, 0.3}, &random);
    const auto result = EstimateTwoView(world.pinhole, seen.pairs, 3, NoisyOptions());
    ASSERT_TRUE(result);
    EXPECT_LT(ErrorDeg(result->solutions[0], b_from_a), 3) << "of the best supported";
    ExpectPointsMatch(world, seen, SE3(), 1, result->solutions[0], 0.1);
    int wrong = 0;
    for (size_t k = 0; k < seen.pairs.size(); ++k)
      wrong += seen.outlier[k] && result->solutions[0].valid[k];
    EXPECT_LT(
        wrong,
        0.1 * result->solutions[0].valid_count);  // Some lie on their epipolar line by chance.
  }
}

TEST(EstimateTwoView, ForwardMotion) {
  const SyntheticWorld world = BoxWorld(5, 600);
  Random random(6);
  for (int i = 0; i < 10; ++i) {
    const SE3 b_from_a(RotationExp(0.03 * RandomDirection(&random)), {0.05, 0.02, -1.5});
    const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {0.5, 0.2}, &random);
    const auto result = EstimateTwoView(world.pinhole, seen.pairs, 3, {});
    ASSERT_TRUE(result);
    EXPECT_LT(BestErrorDeg(*result, b_from_a), 2);
  }
}

TEST(EstimateTwoView, PureRotationGivesNothing) {
  const SyntheticWorld world = BoxWorld(7, 500);
  Random random(8);
  for (int i = 0; i < 10; ++i) {
    const SE3 b_from_a(RotationExp(random.Uniform(0, 0.3) * RandomDirection(&random)),
                       Eigen::Vector3d::Zero());
    for (double noise : {0.0, 0.5, 1.0}) {
      const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {noise, 0.2}, &random);
      EXPECT_FALSE(EstimateTwoView(world.pinhole, seen.pairs, 3, NoisyOptions())) << noise;
    }
  }
}

TEST(EstimateTwoView, TooLittleParallaxGivesNothing) {
  const SyntheticWorld world = BoxWorld(9, 500);
  Random random(10);
  const SE3 b_from_a(Eigen::Quaterniond::Identity(), {0.05, 0, 0});
  const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {0.3, 0}, &random);
  int agreeing = 0;
  EXPECT_FALSE(EstimateTwoView(world.pinhole, seen.pairs, 3, {}, &agreeing));
  EXPECT_GT(agreeing, 0.8 * static_cast<double>(seen.pairs.size())) << "not for want of matches";
}

TEST(EstimateTwoView, NothingFromTooFewUnrelatedOrBadPairs) {
  const SyntheticWorld world = BoxWorld(17, 400);
  Random random(18);
  const SE3 b_from_a = Perturbed(SE3(), 1, 0.1, &random);
  const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {0.3, 0}, &random);
  for (size_t count : {0u, 3u, 4u, 5u, 8u, 49u}) {
    const std::vector<PixelPair> few(seen.pairs.begin(), seen.pairs.begin() + count);
    EXPECT_FALSE(EstimateTwoView(world.pinhole, few, 3, {}));
  }
  const SyntheticPairs unrelated = ObservePairs(world, SE3(), b_from_a, {0, 1}, &random);
  int agreeing = 0;
  EXPECT_FALSE(EstimateTwoView(world.pinhole, unrelated.pairs, 3, {}, &agreeing));
  EXPECT_LT(agreeing, 0.2 * static_cast<double>(unrelated.pairs.size()));
  const std::vector<PixelPair> same(200, PixelPair{{10, 20}, {30, 40}});
  EXPECT_FALSE(EstimateTwoView(world.pinhole, same, 3, {}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(EstimateTwoView(world.pinhole,
                               std::vector<PixelPair>(200, PixelPair{{nan, 20}, {30, 40}}), 3, {}));

  std::vector<PixelPair> some_bad = seen.pairs;
  for (size_t i = 0; i < 20; ++i) some_bad[i].b_px.x() = nan;
  const auto result = EstimateTwoView(world.pinhole, some_bad, 3, {});
  ASSERT_TRUE(result);
  for (size_t i = 0; i < 20; ++i) EXPECT_FALSE(result->solutions[0].valid[i]);
  EXPECT_LT(BestErrorDeg(*result, b_from_a), 1);

  TwoViewOptions options;
  options.max_error_px = 0;
  EXPECT_THROW(EstimateTwoView(world.pinhole, seen.pairs, 3, options), Error);
}

/// What a camera sees that moves by `b_from_a` (300 points), things that drive past it all alike
/// (200), and others that do not (15 %).
std::vector<PixelPair> PairsAmongMovingThings(const SE3& b_from_a) {
  Random random(21);
  const SE3 past(RotationExp({0, 0, 0}), Eigen::Vector3d(0.8, 0, 0.2));
  std::vector<PixelPair> pairs =
      ObservePairs(BoxWorld(22, 300), SE3(), b_from_a, {0.3, 0.15}, &random).pairs;
  const SyntheticWorld things = BoxWorld(23, 200);
  for (const PixelPair& pair :
       ObservePairs(things, SE3(), b_from_a * past, {0.3, 0.15}, &random).pairs)
    pairs.push_back(pair);
  return pairs;
}

TEST(EstimateTwoView, WhatDrivesPastACameraThatHoldsStillIsNoScene) {
  const Pinhole pinhole = BoxWorld(22, 300).pinhole;
  TwoViewOptions options;
  options.min_parallax_deg = 0;
  options.min_certain = 60;
  options.min_homography_share = 0.9;  // of a turn alone, which the essential matrix explains too
  const std::vector<PixelPair> held_still =
      PairsAmongMovingThings(SE3(RotationExp({0, 0.01, 0}), Eigen::Vector3d::Zero()));
  ASSERT_TRUE(EstimateTwoView(pinhole, held_still, 3, options));  // of the things
  options.min_undisputed_ratio = 0.9;
  options.min_moved_ratio = 0.7;
  EXPECT_FALSE(EstimateTwoView(pinhole, held_still, 3, options));
  const SE3 flown(RotationExp({0, 0.01, 0}), Eigen::Vector3d(0.1, 0.5, 0.05));
  const auto result = EstimateTwoView(pinhole, PairsAmongMovingThings(flown), 3, options);
  ASSERT_TRUE(result);
  EXPECT_LT(BestErrorDeg(*result, flown), 2);
}

TEST(EstimateTwoView, ASolutionThatExplainsTooFewOfThePairsIsNone) {
  Random random(17);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(400, {-6, -4, 6}, {6, 4, 15}, &random);
  const SE3 b_from_a(RotationExp({0, 0.02, 0}), {-1, 0, 0.2});
  TwoViewOptions options;
  options.min_valid_ratio = 0.6;
  for (const double wrong : {0.2, 0.6}) {
    const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {0.3, wrong}, &random);
    EXPECT_TRUE(EstimateTwoView(world.pinhole, seen.pairs, 3, {})) << wrong;
    EXPECT_EQ(EstimateTwoView(world.pinhole, seen.pairs, 3, options).has_value(), wrong < 0.4);
  }
}

TEST(EstimateTwoView, TheSeedAloneDecidesTheSamples) {
  Random random(19);
  SyntheticWorld world;
  world.landmarks_world = LandmarksOnGround(800, {-100, -100}, {100, 100}, 2, &random);
  const SE3 a = LookAt({0, -30, 50}, {0, 0, 0}, Eigen::Vector3d::UnitZ());
  const SE3 b = LookAt({15, -35, 50}, {2, 0, 0}, Eigen::Vector3d::UnitZ());
  const SyntheticPairs seen = ObservePairs(world, a, b, {0.7, 0.3}, &random);
  for (uint64_t seed : {0ull, 5ull, ~0ull}) {
    const auto first = EstimateTwoView(world.pinhole, seen.pairs, seed, {});
    const auto second = EstimateTwoView(world.pinhole, seen.pairs, seed, {});
    ASSERT_TRUE(first && second);
    ASSERT_EQ(first->solutions.size(), second->solutions.size());
    for (size_t i = 0; i < first->solutions.size(); ++i) {
      EXPECT_EQ(first->solutions[i].b_from_a.Matrix(), second->solutions[i].b_from_a.Matrix());
      EXPECT_EQ(first->solutions[i].valid, second->solutions[i].valid);
    }
  }
}

}  // namespace
}  // namespace deepuav
