#include "deepuav/estimation/two_views/two_view_certainty.h"

#include <gtest/gtest.h>

#include "support/estimation_problems.h"

namespace deepuav {
namespace {

constexpr double kSigmaPx = 0.5;

/// Some of the points within reach, as many as good as infinitely far.
SyntheticWorld NearAndFar(uint64_t seed) {
  Random random(seed);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(200, {-8, -5, 8}, {8, 5, 25}, &random);
  for (const auto& far : LandmarksInBox(200, {-6000, -4000, 9000}, {6000, 4000, 12000}, &random))
    world.landmarks_world.push_back(far);
  return world;
}

/// What is known without noise: all points, where they are.
TwoViewSolution TrueSolution(const SyntheticWorld& world, const SyntheticPairs& seen,
                             const SE3& b_from_a) {
  TwoViewSolution solution;
  solution.b_from_a = SE3(b_from_a.rotation(), b_from_a.translation().normalized());
  for (int landmark : seen.landmark) {
    solution.points_a.push_back(world.landmarks_world[static_cast<size_t>(landmark)] /
                                b_from_a.translation().norm());
  }
  solution.valid.assign(seen.pairs.size(), 1);
  return solution;
}

TwoViewOptions AnyParallax() {
  TwoViewOptions options;
  options.max_error_px = 6 * kSigmaPx;
  options.min_parallax_deg = 0;
  return options;
}

bool IsFar(const SyntheticPairs& seen, size_t pair) { return seen.landmark[pair] >= 200; }

TEST(RelativeDistanceSigmas, AreTheErrorsOfEstimates) {
  const SyntheticWorld world = NearAndFar(1);
  const SE3 b_from_a(RotationExp({0.01, -0.02, 0.01}), {-0.6, 0.2, -0.9});
  Random random(2);
  double squared = 0;
  int count = 0;
  for (int draw = 0; draw < 30; ++draw) {
    const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {kSigmaPx, 0}, &random);
    const auto found = EstimateTwoView(world.pinhole, seen.pairs, 3, AnyParallax());
    ASSERT_TRUE(found);
    const TwoViewSolution& solution = found->solutions.front();
    const std::vector<double> sigmas =
        RelativeDistanceSigmas(world.pinhole, seen.pairs, solution, kSigmaPx);
    const TwoViewSolution truth = TrueSolution(world, seen, b_from_a);
    for (size_t i = 0; i < sigmas.size(); ++i) {
      if (!solution.valid[i] || IsFar(seen, i) || sigmas[i] > 0.1) continue;
      const double error = solution.points_a[i].norm() / truth.points_a[i].norm() - 1;
      squared += error * error / (sigmas[i] * sigmas[i]);
      ++count;
    }
  }
  ASSERT_GT(count, 1500);
  EXPECT_NEAR(squared / count, 1, 0.35) << "in standard deviations";
}

TEST(RelativeDistanceSigmas, KnowWhatIsTooFarAway) {
  const SyntheticWorld world = NearAndFar(1);
  const SE3 b_from_a(Eigen::Quaterniond::Identity(), {-1, 0, 0});
  Random random(2);
  const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {0, 0}, &random);
  const TwoViewSolution truth = TrueSolution(world, seen, b_from_a);
  const std::vector<double> sigmas =
      RelativeDistanceSigmas(world.pinhole, seen.pairs, truth, kSigmaPx);
  for (size_t i = 0; i < sigmas.size(); ++i) {
    if (IsFar(seen, i)) {
      EXPECT_GT(sigmas[i], 1);
    } else {
      EXPECT_LT(sigmas[i], 0.15);
    }
  }
}

TEST(RelativeDistanceSigmas, GrowTowardsThePointThatIsFlownTo) {
  SyntheticWorld world;
  Random random(2);
  world.landmarks_world = LandmarksInBox(500, {-8, -5, 10}, {8, 5, 11}, &random);
  const SE3 b_from_a(Eigen::Quaterniond::Identity(), {0, 0, -1});
  const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {0, 0}, &random);
  const TwoViewSolution truth = TrueSolution(world, seen, b_from_a);
  const std::vector<double> sigmas =
      RelativeDistanceSigmas(world.pinhole, seen.pairs, truth, kSigmaPx);
  double least_near = 1e9, most_away = 0;
  for (size_t i = 0; i < sigmas.size(); ++i) {
    const double slope = truth.points_a[i].head<2>().norm() / truth.points_a[i].z();
    if (slope < 0.05) least_near = std::min(least_near, sigmas[i]);
    if (slope > 0.5) most_away = std::max(most_away, sigmas[i]);
  }
  EXPECT_GT(least_near, 3 * most_away);
}

TEST(RelativeDistanceSigmas, AreInfiniteOfPointsThatAreNotValid) {
  const SyntheticWorld world = NearAndFar(1);
  const SE3 b_from_a(Eigen::Quaterniond::Identity(), {-1, 0, 0});
  Random random(2);
  const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {0, 0}, &random);
  TwoViewSolution solution = TrueSolution(world, seen, b_from_a);
  solution.valid.assign(solution.valid.size(), 0);
  for (double sigma : RelativeDistanceSigmas(world.pinhole, seen.pairs, solution, kSigmaPx))
    EXPECT_TRUE(std::isinf(sigma));
}

TEST(RelativeDistanceSigmas, AreThoseOfWhatWasMeasured) {
  const SyntheticWorld world = NearAndFar(1);
  const SE3 b_from_a(Eigen::Quaterniond::Identity(), {-1, 0, 0});
  Random random(2);
  SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {0, 0}, &random);
  const TwoViewSolution truth = TrueSolution(world, seen, b_from_a);
  const std::vector<double> detected =
      RelativeDistanceSigmas(world.pinhole, seen.pairs, truth, kSigmaPx);
  constexpr double kRatio = 0.25;
  seen.pairs[0].noise_ratio = kRatio;
  const std::vector<double> one =
      RelativeDistanceSigmas(world.pinhole, seen.pairs, truth, kSigmaPx);
  EXPECT_LT(one[0], 0.8 * detected[0]);
  EXPECT_GT(one[0], kRatio * detected[0]) << "the pose is as uncertain as it was";
  EXPECT_NEAR(one[1] / detected[1], 1, 0.05);
  for (PixelPair& pair : seen.pairs) pair.noise_ratio = kRatio;
  const std::vector<double> all =
      RelativeDistanceSigmas(world.pinhole, seen.pairs, truth, kSigmaPx);
  for (size_t i = 0; i < all.size(); ++i)
    EXPECT_NEAR(all[i] / detected[i], kRatio, 1e-6 * kRatio) << i;
}

TEST(EpipolarSigma, IsThatOfThePixels) {
  const SyntheticWorld world = NearAndFar(3);
  const SE3 b_from_a(RotationExp({0.01, -0.02, 0.01}), {-1, 0.2, 0.3});
  Random random(4);
  const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {kSigmaPx, 0}, &random);
  const auto found = EstimateTwoView(world.pinhole, seen.pairs, 3, AnyParallax());
  ASSERT_TRUE(found);
  const TwoViewSolution& solution = found->solutions.front();
  EXPECT_NEAR(EpipolarSigmaPx(world.pinhole, seen.pairs, solution, 0.01), kSigmaPx, 0.1);
  EXPECT_EQ(EpipolarSigmaPx(world.pinhole, seen.pairs, solution, 2), 2);
  std::vector<PixelPair> said_better = seen.pairs;
  for (PixelPair& pair : said_better) pair.noise_ratio = 0.5;
  EXPECT_NEAR(EpipolarSigmaPx(world.pinhole, said_better, solution, 0.01), kSigmaPx / 0.5, 0.2);
}

}  // namespace
}  // namespace deepuav
