#include "deepuav/estimation/bundle/reweighed_adjustment.h"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "deepuav/base/error.h"
#include "deepuav/estimation/testing/bundle_worlds.h"

namespace deepuav {
namespace {

TEST(WeightsByErrors, FallWithTheErrorOfObservationAndLandmark) {
  const std::vector<double> errors = {0, 1, 4, 0, 30, std::numeric_limits<double>::infinity()};
  const std::vector<int> landmarks = {0, 0, 0, 1, 1, 1};
  const std::vector<double> weights = WeightsByErrors(errors, landmarks, {});
  EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 6, 1e-9);
  EXPECT_NEAR(weights[1], weights[0] / 4, 1e-9);
  EXPECT_NEAR(weights[2], weights[0] / 25, 1e-9);
  EXPECT_LT(weights[3], 0.7 * weights[0]) << "what its landmark's other views miss it by counts";
  EXPECT_GT(weights[3], 0.1 * weights[0]) << "but one outlier does not undo a landmark";
  EXPECT_GT(weights[5], 0);
  EXPECT_LT(weights[5], 1e-6);
}

/// Three in ten of the errors have three times the stated deviation, as positions have that edges
/// of depth and shadows disturb; some landmarks err so in all their views.
BundleProblem LongTailedProblem(const SyntheticWorld& world, Random* random) {
  BundleProblem problem = MakeBundleProblem(world, {}, random);
  for (BundleObservation& o : problem.observations) {
    const bool is_disturbed = o.landmark % 5 == 0 || random->Uniform(0, 1) < 0.2;
    const double sigma = is_disturbed ? 3 : 0.5;
    o.px += Eigen::Vector2d(random->Gaussian(sigma), random->Gaussian(sigma));
  }
  return problem;
}

double CentreError(const BundleProblem& problem, const SyntheticWorld& world) {
  double squared = 0;
  for (size_t i = 0; i < world.cam_from_world.size(); ++i) {
    squared += (problem.cam_from_world[i].InverseTranslation() -
                world.cam_from_world[i].InverseTranslation())
                   .squaredNorm();
  }
  return std::sqrt(squared / static_cast<double>(world.cam_from_world.size()));
}

/// Errors are as stated.
BundleProblem NormalProblem(const SyntheticWorld& world, Random* random) {
  BundleProblem problem = MakeBundleProblem(world, {}, random);
  for (BundleObservation& o : problem.observations)
    o.px += Eigen::Vector2d(random->Gaussian(1), random->Gaussian(1));
  return problem;
}

/// The error of the centres of five worlds, adjusted by weights over as stated.
template <typename MakeProblem, typename Adjust>
double ErrorOverPlain(const MakeProblem& make, const Adjust& adjust) {
  double plain_sum = 0, weighed_sum = 0;
  for (const int seed : {1, 2, 3, 4, 5}) {
    const SyntheticWorld world = OrbitWorld(17, 12, 300);
    Random random(static_cast<uint64_t>(seed));
    BundleProblem problem = make(world, &random);
    AdjustBundle(&problem, Precise());
    plain_sum += CentreError(problem, world);
    adjust(&problem);
    weighed_sum += CentreError(problem, world);
  }
  return weighed_sum / plain_sum;
}

TEST(AdjustReweighed, FindsPosesThatLongTailsDoNotBend) {
  const auto adjust = [](BundleProblem* problem) {
    const std::vector<BundleObservation> stated = problem->observations;
    const BundleReport report = AdjustReweighed(problem, Precise(), {});
    ASSERT_EQ(report.outlier.size(), stated.size());
    const std::vector<double> errors = SquaredErrors(*problem);
    for (size_t i = 0; i < stated.size(); ++i) {
      ASSERT_EQ(problem->observations[i].noise, stated[i].noise);
      ASSERT_EQ(report.outlier[i] != 0, !(errors[i] <= Precise().chi_square));
    }
  };
  EXPECT_LT(ErrorOverPlain(LongTailedProblem, adjust), 0.8);
}

TEST(AdjustReweighed, LosesLittleWhereErrorsAreAsStated) {
  const auto adjust = [](BundleProblem* problem) { AdjustReweighed(problem, Precise(), {}); };
  EXPECT_LT(ErrorOverPlain(NormalProblem, adjust), 1.4);
}

TEST(AdjustReweighed, WithoutRoundsItIsAdjustBundle) {
  const SyntheticWorld world = OrbitWorld(17, 6, 100);
  Random random(1);
  BundleProblem problem = LongTailedProblem(world, &random);
  BundleProblem plain = problem;
  const BundleReport report = AdjustReweighed(&problem, Precise(), {.rounds = 0});
  const BundleReport plain_report = AdjustBundle(&plain, Precise());
  EXPECT_EQ(report.final_cost, plain_report.final_cost);
  EXPECT_EQ(report.outlier, plain_report.outlier);
  EXPECT_EQ(problem.cam_from_world[3].Matrix(), plain.cam_from_world[3].Matrix());
}

TEST(AdjustReweighed, StopsWhenAsked) {
  const SyntheticWorld world = OrbitWorld(17, 6, 100);
  Random random(1);
  BundleProblem problem = LongTailedProblem(world, &random);
  const BundleProblem before = problem;
  const BundleReport report = AdjustReweighed(&problem, Precise(), {}, [] { return true; });
  EXPECT_EQ(problem.cam_from_world[3].Matrix(), before.cam_from_world[3].Matrix());
  EXPECT_EQ(report.outlier.size(), before.observations.size());
}

TEST(AdjustByTails, FindsPosesThatLongTailsDoNotBend) {
  const auto adjust = [](BundleProblem* problem) { AdjustByTails(problem, Precise(), {}); };
  EXPECT_LT(ErrorOverPlain(LongTailedProblem, adjust), 0.85);
}

TEST(AdjustByTails, LosesNothingWhereErrorsAreAsStated) {
  const auto adjust = [](BundleProblem* problem) { AdjustByTails(problem, Precise(), {}); };
  EXPECT_LT(ErrorOverPlain(NormalProblem, adjust), 1.05);
}

TEST(AdjustByTails, WithoutRoundsItIsAdjustBundle) {
  const SyntheticWorld world = OrbitWorld(17, 6, 100);
  Random random(1);
  BundleProblem problem = LongTailedProblem(world, &random);
  BundleProblem plain = problem;
  AdjustByTails(&problem, Precise(), {.rounds = 0});
  AdjustBundle(&plain, Precise());
  EXPECT_EQ(problem.cam_from_world[3].Matrix(), plain.cam_from_world[3].Matrix());
}

TEST(TailOptions, OutOfRangeAreRefused) {
  EXPECT_THROW(TailOptions{.rounds = -1}.Check(), Error);
  EXPECT_THROW(TailOptions{.min_freedom = 0}.Check(), Error);
  EXPECT_NO_THROW(TailOptions{}.Check());
}

TEST(ReweighingOptions, OutOfRangeAreRefused) {
  EXPECT_THROW(ReweighingOptions{.quarter_at = 0}.Check(), Error);
  EXPECT_THROW(ReweighingOptions{.rounds = -1}.Check(), Error);
}

}  // namespace
}  // namespace deepuav
