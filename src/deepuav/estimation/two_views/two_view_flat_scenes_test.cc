#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "deepuav/estimation/testing/two_view_errors.h"
#include "support/estimation_problems.h"

namespace deepuav {
namespace {

class NadirTest : public testing::TestWithParam<double> {};

TEST_P(NadirTest, PlaneFromAboveKeepsTheTrueSolution) {
  const double tilt = GetParam();
  Random random(11);
  SyntheticWorld world;
  world.landmarks_world = LandmarksOnGround(9000, {-120, -120}, {120, 120}, 0, &random);
  const double height = 60;
  const double footprint = height * world.width / world.pinhole.fx;
  for (int i = 0; i < 10; ++i) {
    const SE3 a_from_world =
        SE3(RotationExp(tilt * RandomDirection(&random)), Eigen::Vector3d::Zero()) *
        LookDown({0, 0, height}, -M_PI / 2);
    // Flown along the image's wide side, of which 25 % overlap.
    const SE3 b_from_world =
        SE3(RotationExp(tilt * RandomDirection(&random)), Eigen::Vector3d::Zero()) *
        LookDown({0.75 * footprint, 0, height}, -M_PI / 2 + random.Uniform(-0.1, 0.1));
    const SE3 truth = b_from_world * a_from_world.Inverse();
    const SyntheticPairs seen = ObservePairs(world, a_from_world, b_from_world, {1, 0.3}, &random);
    ASSERT_GT(seen.pairs.size(), 100u);
    const auto result = EstimateTwoView(world.pinhole, seen.pairs, 3, NoisyOptions());
    ASSERT_TRUE(result) << i;
    EXPECT_LT(BestErrorDeg(*result, truth), 3) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(TiltRadians, NadirTest, testing::Values(0.0, 0.05, 0.15));

/// Neither model alone finds all of them: noise hides what little depth there is.
TEST(EstimateTwoView, FindsThePosesOfAShallowSceneWithLittleParallax) {
  int found = 0, wrong = 0;
  for (uint64_t trial = 0; trial < 100; ++trial) {
    Random random(100 + trial);
    SyntheticWorld world;
    world.landmarks_world = LandmarksInBox(150, {-3, -2, 4.2}, {3, 2, 5.8}, &random);
    const SE3 b_from_a(RotationExp(0.05 * RandomDirection(&random)),
                       0.35 * RandomDirection(&random));
    const SyntheticPairs seen = ObservePairs(world, SE3(), b_from_a, {1.2, 0.25}, &random);
    TwoViewOptions options;
    options.min_parallax_deg = 2;
    const auto result = EstimateTwoView(world.pinhole, seen.pairs, trial, options);
    if (result) ++(BestErrorDeg(*result, b_from_a) < 10 ? found : wrong);
  }
  EXPECT_GE(found, 70);
  EXPECT_LE(wrong, 5);
}

TEST(EstimateTwoView, PlaneApproachedGivesBothSolutionsAndAThirdViewTellsThemApart) {
  Random random(13);
  SyntheticWorld world;
  world.landmarks_world = LandmarksOnGround(1500, {-100, -100}, {100, 100}, 0, &random);
  // Travel at 45 degrees to the ground: the false solution takes its direction for the plane's
  // normal.
  const SE3 a = LookDown({0, 0, 60}, 0);
  const SE3 b = LookDown({15, 5, 45}, 0.1);
  const SE3 c = LookDown({-5, 20, 50}, -0.1);
  const SyntheticPairs seen = ObservePairs(world, a, b, {0.5, 0.1}, &random);
  const auto result = EstimateTwoView(world.pinhole, seen.pairs, 3, {});
  ASSERT_TRUE(result);
  ASSERT_EQ(result->solutions.size(), 2u);
  EXPECT_LT(BestErrorDeg(*result, b * a.Inverse()), 2);

  // The points of the true solution alone fit the third view.
  const double baseline = (b * a.Inverse()).translation().norm();
  std::vector<double> rms;
  for (const TwoViewSolution& solution : result->solutions) {
    std::vector<PoseObservation> observations;
    for (size_t i = 0; i < seen.pairs.size(); ++i) {
      if (!solution.valid[i]) continue;
      const Eigen::Vector2d px = world.pinhole.Project(c * world.landmarks_world[seen.landmark[i]]);
      observations.push_back({solution.points_a[i], px, 1});
    }
    const SE3 c_from_a = c * a.Inverse();
    MotionOnlyOptions options;
    options.chi_square = 1e6;
    rms.push_back(OptimisePose(world.pinhole, observations,
                               SE3(c_from_a.rotation(), c_from_a.translation() / baseline), options)
                      .rms_px);
  }
  const bool first_is_true = RotationErrorDeg(result->solutions[0].b_from_a, b * a.Inverse()) <
                             RotationErrorDeg(result->solutions[1].b_from_a, b * a.Inverse());
  EXPECT_LT(2 * rms[first_is_true ? 0 : 1], rms[first_is_true ? 1 : 0]);
}

/// Where the parallax asked for lies between those of the two solutions of a plane, neither may win
/// for its parallax.
TEST(EstimateTwoView, TheRivalOfAPlaneIsNotChosenForItsParallax) {
  Random random(13);
  SyntheticWorld world;
  world.landmarks_world = LandmarksOnGround(1500, {-100, -100}, {100, 100}, 0, &random);
  const SyntheticPairs seen =
      ObservePairs(world, LookDown({0, 0, 60}, 0), LookDown({15, 5, 45}, 0.1), {0.5, 0.1}, &random);
  const auto both = EstimateTwoView(world.pinhole, seen.pairs, 3, {});
  ASSERT_TRUE(both);
  ASSERT_EQ(both->solutions.size(), 2u);
  const double best_deg = both->solutions[0].median_parallax_deg,
               rival_deg = both->solutions[1].median_parallax_deg;
  ASSERT_GT(std::abs(best_deg - rival_deg), 0.1);
  TwoViewOptions options;
  options.min_parallax_deg = 0.5 * (best_deg + rival_deg);
  const auto found = EstimateTwoView(world.pinhole, seen.pairs, 3, options);
  if (best_deg < rival_deg) {
    EXPECT_FALSE(found);
  } else {
    ASSERT_TRUE(found);
    EXPECT_EQ(found->solutions.size(), 2u);
  }
}

TEST(EstimateTwoView, PointsOffThePlaneSupportTheTrueSolutionMost) {
  Random random(15);
  for (int i = 0; i < 5; ++i) {
    SyntheticWorld world;
    world.landmarks_world = LandmarksOnGround(1200, {-100, -100}, {100, 100}, 0, &random);
    for (int k = 0; k < 120; ++k) world.landmarks_world[10 * k].z() = random.Uniform(5, 25);
    const SE3 a = LookAt({0, -30, 50}, {0, 0, 0}, Eigen::Vector3d::UnitZ());
    const SE3 b = LookAt({random.Uniform(12, 18), -35, 50}, {2, 0, 0}, Eigen::Vector3d::UnitZ());
    const SyntheticPairs seen = ObservePairs(world, a, b, {0.5, 0.1}, &random);
    const auto result = EstimateTwoView(world.pinhole, seen.pairs, 3, {});
    ASSERT_TRUE(result);
    EXPECT_LT(RotationErrorDeg(result->solutions[0].b_from_a, b * a.Inverse()), 0.5);
    EXPECT_LT(DirectionErrorDeg(result->solutions[0].b_from_a, b * a.Inverse()), 2);
  }
}

}  // namespace
}  // namespace deepuav
