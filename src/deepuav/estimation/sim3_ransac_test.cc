#include "deepuav/estimation/sim3_ransac.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "support/sim3_problems.h"

namespace deepuav {
namespace {

double Difference(const Sim3& a, const Sim3& b) { return (a * b.Inverse()).Log().norm(); }

TEST(EstimateSim3, FindsTheExactSimilarityWithoutNoiseAtAnyScale) {
  Random random(1);
  for (double scale : {0.1, 0.3, 1.0, 4.0, 10.0}) {
    const SyntheticSim3 problem = MakeSim3Problem(50, scale, {}, &random);
    const auto estimate = EstimateSim3(problem.pinhole, problem.correspondences, 1, {});
    ASSERT_TRUE(estimate) << "scale " << scale;
    EXPECT_LT(Difference(estimate->a_from_b, problem.a_from_b), 1e-8) << "scale " << scale;
    EXPECT_EQ(estimate->inlier_count, 50);
    EXPECT_LE(estimate->iterations, 2);  // All are inliers: no second sample is needed.
  }
}

TEST(EstimateSim3, WithNoiseAndSixtyPercentOutliers) {
  Random random(2);
  for (double scale : {0.1, 1.0, 10.0}) {
    for (int run = 0; run < 10; ++run) {
      const SyntheticSim3 problem = MakeSim3Problem(100, scale, {1, 0.01, 0.6}, &random);
      const auto estimate = EstimateSim3(problem.pinhole, problem.correspondences, run, {});
      ASSERT_TRUE(estimate) << "scale " << scale << ", run " << run;
      EXPECT_LT(Difference(estimate->a_from_b, problem.a_from_b), 0.1);
      int wrong = 0, good = 0, all_good = 0;
      for (size_t i = 0; i < problem.outlier.size(); ++i) {
        wrong += problem.outlier[i] && estimate->inlier[i];
        good += !problem.outlier[i] && estimate->inlier[i];
        all_good += !problem.outlier[i];
      }
      EXPECT_LE(wrong, 3);
      EXPECT_GE(good, 0.85 * all_good);
    }
  }
}

TEST(EstimateSim3, RefinementBeatsThreePointsWithErrorsInDepth) {
  Sim3RansacOptions plain;
  plain.refinements = 0;
  double with = 0, without = 0;
  for (int run = 0; run < 20; ++run) {
    Random random(50 + run);
    const SyntheticSim3 problem = MakeSim3Problem(150, 1, {1, 0.05, 0.4}, &random);
    const auto refined = EstimateSim3(problem.pinhole, problem.correspondences, run, {});
    const auto sampled = EstimateSim3(problem.pinhole, problem.correspondences, run, plain);
    ASSERT_TRUE(refined && sampled);
    with += Difference(refined->a_from_b, problem.a_from_b);
    without += Difference(sampled->a_from_b, problem.a_from_b);
  }
  EXPECT_LT(with, 0.6 * without);
}

TEST(EstimateSim3, FixedScaleIsOne) {
  Random random(3);
  const SyntheticSim3 problem = MakeSim3Problem(100, 1, {1, 0.02, 0.3}, &random);
  Sim3RansacOptions options;
  options.fixed_scale = true;
  const auto estimate = EstimateSim3(problem.pinhole, problem.correspondences, 1, options);
  ASSERT_TRUE(estimate);
  EXPECT_EQ(estimate->a_from_b.scale(), 1);
  EXPECT_LT(Difference(estimate->a_from_b, problem.a_from_b), 0.05);
}

TEST(EstimateSim3, UnrelatedLandmarksHaveNone) {
  Random random(4);
  for (int run = 0; run < 10; ++run) {
    const SyntheticSim3 problem = MakeSim3Problem(100, 1, {1, 0.02, 1}, &random);
    EXPECT_FALSE(EstimateSim3(problem.pinhole, problem.correspondences, run, {}));
  }
}

TEST(EstimateSim3, DegenerateLandmarksHaveNone) {
  Random random(5);
  const SyntheticSim3 problem = MakeSim3Problem(30, 1, {0.5, 0, 0}, &random);
  auto on_a_line = problem.correspondences;
  for (size_t i = 0; i < on_a_line.size(); ++i) {
    const double along = 0.1 * static_cast<double>(i);
    on_a_line[i].point_a = on_a_line[i].point_b = Eigen::Vector3d(along, 0.5 * along, 5 + along);
    on_a_line[i].px_a = on_a_line[i].px_b = problem.pinhole.Project(on_a_line[i].point_a);
  }
  EXPECT_FALSE(EstimateSim3(problem.pinhole, on_a_line, 1, {}));

  auto coincident = problem.correspondences;
  for (auto& c : coincident) c = coincident[0];
  EXPECT_FALSE(EstimateSim3(problem.pinhole, coincident, 1, {}));

  auto behind = problem.correspondences;
  for (auto& c : behind) c.point_b *= -1;
  EXPECT_FALSE(EstimateSim3(problem.pinhole, behind, 1, {}));

  for (int count : {2, 0}) {
    auto few = problem.correspondences;
    few.resize(count);
    EXPECT_FALSE(EstimateSim3(problem.pinhole, few, 1, {}));
  }
}

TEST(EstimateSim3, SomeLandmarksBehindOrNotFiniteAreOutliers) {
  Random random(6);
  SyntheticSim3 problem = MakeSim3Problem(100, 2, {0.5, 0, 0}, &random);
  for (int i = 0; i < 30; ++i) problem.correspondences[i].point_b *= -1;
  problem.correspondences[30].point_a.setConstant(std::nan(""));
  problem.correspondences[31].sigma_b_px = -1;
  const auto estimate = EstimateSim3(problem.pinhole, problem.correspondences, 1, {});
  ASSERT_TRUE(estimate);
  EXPECT_LT(Difference(estimate->a_from_b, problem.a_from_b), 0.03);
  for (int i = 0; i < 32; ++i) EXPECT_FALSE(estimate->inlier[i]) << i;
}

TEST(EstimateSim3, TheSameSeedGivesTheSameBits) {
  Random random(7);
  const SyntheticSim3 problem = MakeSim3Problem(100, 1, {1, 0.05, 0.5}, &random);
  const auto a = EstimateSim3(problem.pinhole, problem.correspondences, 5, {});
  const auto b = EstimateSim3(problem.pinhole, problem.correspondences, 5, {});
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->a_from_b.translation(), b->a_from_b.translation());
  EXPECT_EQ(a->a_from_b.rotation().coeffs(), b->a_from_b.rotation().coeffs());
  EXPECT_EQ(a->a_from_b.scale(), b->a_from_b.scale());
  EXPECT_EQ(a->inlier, b->inlier);
}

TEST(EstimateSim3, RefusesBadOptions) {
  Sim3RansacOptions options;
  options.confidence = 1;
  EXPECT_THROW(EstimateSim3({450, 450, 1, 1}, {}, 1, options), Error);
  options = {};
  options.min_inliers = 2;
  EXPECT_THROW(EstimateSim3({450, 450, 1, 1}, {}, 1, options), Error);
}

}  // namespace
}  // namespace deepuav
