#include "deepuav/estimation/poses/sim3_optimisation.h"

#include <gtest/gtest.h>

#include <limits>

#include "deepuav/base/error.h"
#include "support/numeric_jacobian.h"
#include "support/sim3_problems.h"

namespace deepuav {
namespace {

double Difference(const Sim3& a, const Sim3& b) { return (a * b.Inverse()).Log().norm(); }

Sim3 Disturbed(const Sim3& transform, double sigma, Random* random) {
  Vector7d tangent;
  for (int i = 0; i < 7; ++i) tangent[i] = random->Gaussian(sigma);
  return Sim3::Exp(tangent) * transform;
}

TEST(OptimiseSim3, FindsTheExactSimilarityWithoutNoiseAtAnyScale) {
  Random random(1);
  for (double scale : {0.1, 0.5, 1.0, 3.0, 10.0}) {
    const SyntheticSim3 problem = MakeSim3Problem(100, scale, {}, &random);
    const Sim3 initial = Disturbed(problem.a_from_b, 0.05, &random);
    const Sim3OptimisationResult result =
        OptimiseSim3(problem.pinhole, problem.correspondences, initial, {});
    EXPECT_LT(Difference(result.a_from_b, problem.a_from_b), 1e-8) << "scale " << scale;
    EXPECT_EQ(result.inlier_count, 100);
    EXPECT_LT(result.rms_px, 1e-6);
  }
}

TEST(OptimiseSim3, SeparatesOutliersUnderNoise) {
  Random random(2);
  const SyntheticSim3 problem = MakeSim3Problem(300, 2, {1, 0.01, 0.3}, &random);
  const Sim3OptimisationResult result = OptimiseSim3(
      problem.pinhole, problem.correspondences, Disturbed(problem.a_from_b, 0.03, &random), {});
  EXPECT_LT(Difference(result.a_from_b, problem.a_from_b), 0.03);
  int wrong = 0, good = 0, all_good = 0;
  for (size_t i = 0; i < problem.outlier.size(); ++i) {
    wrong += problem.outlier[i] && result.inlier[i];
    good += !problem.outlier[i] && result.inlier[i];
    all_good += !problem.outlier[i];
  }
  EXPECT_LE(wrong, 3);
  EXPECT_GT(good, 0.9 * all_good);
  EXPECT_NEAR(result.rms_px, 1.45, 0.25);  // Two axes of 1 px, and the landmarks' errors in depth.
}

TEST(OptimiseSim3, InformationEqualsTheNumericJacobian) {
  Random random(3);
  SyntheticSim3 problem = MakeSim3Problem(40, 1.7, {}, &random);
  for (auto& c : problem.correspondences) {
    c.sigma_a_px = random.Uniform(0.5, 2);
    c.sigma_b_px = random.Uniform(0.5, 2);
  }
  const Sim3OptimisationResult result =
      OptimiseSim3(problem.pinhole, problem.correspondences, problem.a_from_b, {});
  Matrix7d expected = Matrix7d::Zero();
  for (const Sim3Correspondence& c : problem.correspondences) {
    const auto residual = [&](const Eigen::VectorXd& tangent) -> Eigen::VectorXd {
      const Sim3 a_from_b = Sim3::Exp(Vector7d(tangent)) * result.a_from_b;
      Eigen::VectorXd errors(4);
      errors.head<2>() = (problem.pinhole.Project(a_from_b * c.point_b) - c.px_a) / c.sigma_a_px;
      errors.tail<2>() =
          (problem.pinhole.Project(a_from_b.Inverse() * c.point_a) - c.px_b) / c.sigma_b_px;
      return errors;
    };
    const Eigen::MatrixXd jacobian = NumericJacobian(residual, 7);
    expected += jacobian.transpose() * jacobian;
  }
  EXPECT_LT((result.information - expected).norm(), 1e-7 * expected.norm());
}

TEST(OptimiseSim3, InformationIsTheInverseOfTheScatter) {
  Matrix7d scatter = Matrix7d::Zero();
  Sim3OptimisationOptions options;
  options.chi_square = 100;  // No inlier is cut, so that the theory holds exactly.
  const int runs = 300;
  for (int i = 0; i < runs; ++i) {
    Random random(100 + i);
    const SyntheticSim3 problem = MakeSim3Problem(100, 1.5, {1, 0, 0}, &random);
    const Sim3OptimisationResult result =
        OptimiseSim3(problem.pinhole, problem.correspondences, problem.a_from_b, options);
    // Each run has a scene of its own: whiten by its own information.
    const Eigen::LLT<Matrix7d> factor(result.information);
    const Vector7d white = factor.matrixU() * (result.a_from_b * problem.a_from_b.Inverse()).Log();
    scatter += white * white.transpose() / runs;
  }
  EXPECT_NEAR(scatter.trace(), 7, 0.7);
}

TEST(OptimiseSim3, KeepsAFixedScale) {
  Random random(4);
  const SyntheticSim3 problem = MakeSim3Problem(100, 1, {1, 0, 0.1}, &random);
  Sim3OptimisationOptions options;
  options.fixed_scale = true;
  const Sim3 initial(SE3::Exp(Vector6d::Constant(0.02)) *
                     SE3(problem.a_from_b.rotation(), problem.a_from_b.translation()));
  const Sim3OptimisationResult result =
      OptimiseSim3(problem.pinhole, problem.correspondences, initial, options);
  EXPECT_EQ(result.a_from_b.scale(), 1);
  EXPECT_LT(Difference(result.a_from_b, problem.a_from_b), 0.02);
  EXPECT_EQ(result.information.row(6).norm(), 0);
}

TEST(OptimiseSim3, LandmarksBehindACameraAreOutliersAndBadValuesNeverSpread) {
  Random random(5);
  SyntheticSim3 problem = MakeSim3Problem(100, 1, {0.3, 0, 0}, &random);
  auto& c = problem.correspondences;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 20; ++i) c[i].point_a *= -1;
  c[20].point_b.x() = nan;
  c[21].px_a.y() = std::numeric_limits<double>::infinity();
  c[22].sigma_b_px = 0;
  c[23].sigma_a_px = nan;
  c[24].point_a.setZero();
  c[25].px_b.setConstant(1e200);
  const Sim3OptimisationResult result =
      OptimiseSim3(problem.pinhole, c, Disturbed(problem.a_from_b, 0.02, &random), {});
  EXPECT_LT(Difference(result.a_from_b, problem.a_from_b), 0.02);
  for (int i = 0; i < 26; ++i) EXPECT_FALSE(result.inlier[i]) << i;
  EXPECT_GE(result.inlier_count, 70);
}

TEST(OptimiseSim3, KeepsTheInitialEstimateWithFewerThanThreeInliers) {
  Random random(6);
  SyntheticSim3 problem = MakeSim3Problem(2, 1, {}, &random);
  const Sim3 initial = Disturbed(problem.a_from_b, 0.1, &random);
  for (int count : {2, 0}) {
    problem.correspondences.resize(count);
    const Sim3OptimisationResult result =
        OptimiseSim3(problem.pinhole, problem.correspondences, initial, {});
    EXPECT_EQ(result.a_from_b.translation(), initial.translation());
    EXPECT_EQ(result.a_from_b.scale(), initial.scale());
  }
  const Sim3 not_one(std::numeric_limits<double>::quiet_NaN(), Eigen::Quaterniond::Identity(),
                     Eigen::Vector3d::Zero());
  const SyntheticSim3 full = MakeSim3Problem(50, 1, {}, &random);
  EXPECT_EQ(OptimiseSim3(full.pinhole, full.correspondences, not_one, {}).inlier_count, 0);
}

TEST(OptimiseSim3, RefusesBadOptions) {
  Sim3OptimisationOptions options;
  options.rounds = 0;
  EXPECT_THROW(OptimiseSim3({450, 450, 1, 1}, {}, {}, options), Error);
  EXPECT_THROW(OptimiseSim3({0, 450, 1, 1}, {}, {}, {}), Error);
}

}  // namespace
}  // namespace deepuav
