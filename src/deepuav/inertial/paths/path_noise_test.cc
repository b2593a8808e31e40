#include "deepuav/inertial/paths/path_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "support/inertial_flight.h"

namespace deepuav {
namespace {

constexpr double kRate_hz = 10;

/// Poses of a winding flight that err by `sigma_m` an axis.
Trajectory NoisyPath(double seconds, double sigma_m) {
  Random random(1);
  return AddNoise(InertialFlight().CameraPath(0, seconds, kRate_hz, SE3(), Sim3()), sigma_m,
                  random);
}

void Shift(const Eigen::Vector3d& by, TimedPose* pose) {
  pose->world_from_cam = {pose->world_from_cam.rotation(), pose->world_from_cam.translation() + by};
}

/// The numbers of the poses that are not among those kept.
std::set<size_t> MissingOf(const Trajectory& path, const Trajectory& kept) {
  std::set<size_t> missing;
  size_t next = 0;
  for (size_t k = 0; k < path.size(); ++k) {
    if (next < kept.size() && kept[next].time == path[k].time) {
      ++next;
    } else {
      missing.insert(k);
    }
  }
  return missing;
}

TEST(WithoutJumps, TakesWrongPosesOutWithTheirNeighboursAlone) {
  constexpr double kSigma_m = 0.02;
  Trajectory path = NoisyPath(30, kSigma_m);
  const size_t last = path.size() - 1;
  for (const size_t wrong : {size_t{0}, size_t{100}, last}) Shift({3, 0, 0}, &path[wrong]);
  Shift({0, 10 * kSigma_m, 0}, &path[200]);  // as poses may err
  const std::set<size_t> expected = {0, 1, 99, 100, 101, last - 1, last};
  EXPECT_EQ(MissingOf(path, WithoutJumps(path)), expected);
}

/// Residuals of poses of which some are far off; turn and position err by these.
std::vector<Vector6d> Residuals(const std::vector<double>& position_sigma, double turn_sigma,
                                double wrong_share) {
  constexpr double kWrong = 50;
  Random random(3);
  std::vector<Vector6d> residuals;
  for (const double sigma : position_sigma) {
    const double times = random.Uniform(0, 1) < wrong_share ? kWrong : 1;
    Vector6d& residual = residuals.emplace_back();
    residual.head<3>() = GaussianVector(times * turn_sigma, &random);
    residual.tail<3>() = GaussianVector(times * sigma, &random);
  }
  return residuals;
}

InertialProblem ProblemOf(const Trajectory& path) {
  InertialProblem problem{};
  problem.path = path;
  problem.position_sigma.assign(path.size(), 1);
  return problem;
}

TEST(EstimatePathNoise, AQuietAndANoisyStretchGetTheirOwnDespiteWrongPoses) {
  constexpr double kQuiet = 0.01, kNoisy = 0.04, kTurn = 1e-3, kWrongShare = 0.05;
  InertialProblem problem = ProblemOf(NoisyPath(120, 0));
  const size_t count = problem.size(), half = count / 2;
  std::vector<double> truth(count, kQuiet);
  std::fill(truth.begin() + static_cast<std::ptrdiff_t>(half), truth.end(), kNoisy);
  EstimatePathNoise(Residuals(truth, kTurn, kWrongShare), &problem);
  const auto mean = [&](size_t from, size_t to) {
    double sum = 0;
    for (size_t k = from; k < to; ++k) sum += problem.position_sigma[k];
    return sum / static_cast<double>(to - from);
  };
  constexpr size_t kAway = 25;  // poses from the change, beyond the stretch about a pose
  EXPECT_NEAR(mean(0, half - kAway) / kQuiet, 1, 0.15);
  EXPECT_NEAR(mean(half + kAway, count) / kNoisy, 1, 0.15);
  for (const double sigma : problem.turn_sigma_rad) EXPECT_NEAR(sigma / kTurn, 1, 0.1);
}

TEST(EstimatePathNoise, APathWithoutErrorsCanStillBeWeighed) {
  InertialProblem problem = ProblemOf(NoisyPath(10, 0));
  EstimatePathNoise(std::vector<Vector6d>(problem.size(), Vector6d::Zero()), &problem);
  for (size_t k = 0; k < problem.size(); ++k) {
    EXPECT_GT(problem.position_sigma[k], 0);
    EXPECT_GT(problem.turn_sigma_rad[k], 0);
  }
}

/// Errors of positions of one standard deviation, each `correlation` of the one before.
std::vector<Vector6d> Correlated(size_t count, double correlation) {
  Random random(4);
  std::vector<Vector6d> residuals(count, Vector6d::Zero());
  Eigen::Vector3d error = GaussianVector(1, &random);
  for (Vector6d& residual : residuals) {
    residual.tail<3>() = error;
    error = correlation * error + GaussianVector(std::sqrt(1 - correlation * correlation), &random);
  }
  return residuals;
}

TEST(VarianceInflation, IsThatOfTheMeanOfCorrelatedErrors) {
  const InertialProblem problem = ProblemOf(NoisyPath(400, 0));
  for (const double correlation : {0.5, 0.8}) {
    const double truth = (1 + correlation) / (1 - correlation);
    const double found = VarianceInflation(Correlated(problem.size(), correlation), problem);
    EXPECT_NEAR(found / truth, 1, 0.2) << correlation;
  }
}

TEST(VarianceInflation, IsNoneWhereErrorsAreIndependentOrNone) {
  const InertialProblem problem = ProblemOf(NoisyPath(400, 0));
  std::vector<Vector6d> residuals = Correlated(problem.size(), 0);
  EXPECT_EQ(VarianceInflation(residuals, problem), 1);
  // Two wrong poses beside one another say nothing of all the others.
  residuals[70].tail<3>().setConstant(1e4);
  residuals[71].tail<3>().setConstant(1e4);
  EXPECT_EQ(VarianceInflation(residuals, problem), 1);
  residuals.assign(problem.size(), Vector6d::Zero());
  EXPECT_EQ(VarianceInflation(residuals, problem), 1);
}

TEST(WithoutJumps, AFlightIsNoJumpAfterALongTimeOnTheGround) {
  constexpr double kGround_s = 40, kFlight_s = 20;
  // On the ground the same pixels say the same again and again.
  constexpr double kSigmaOnGround_m = 2e-4, kSigmaInAir_m = 0.01;
  Random random(2);
  Trajectory path;
  for (double t = 0; t < kGround_s; t += 1 / kRate_hz) path.push_back({AtSeconds(t), SE3()});
  path = AddNoise(path, kSigmaOnGround_m, random);
  for (TimedPose pose : NoisyPath(kFlight_s, kSigmaInAir_m)) {
    pose.time.nanoseconds += AtSeconds(kGround_s).nanoseconds;
    path.push_back(pose);
  }
  const auto flown = [&](const Trajectory& poses) {
    return std::count_if(poses.begin(), poses.end(),
                         [&](const TimedPose& pose) { return pose.time >= AtSeconds(kGround_s); });
  };
  EXPECT_GT(flown(WithoutJumps(path)), 0.9 * static_cast<double>(flown(path)));
}

TEST(WithoutJumps, LeavesPathsThatTellNoJump) {
  Trajectory straight;
  for (int i = 0; i < 50; ++i)
    straight.push_back({AtSeconds(0.1 * i), SE3(Eigen::Quaterniond::Identity(), {0.3 * i, 0, 0})});
  for (const size_t count : {0, 1, 2, 50}) {
    const Trajectory path(straight.begin(), straight.begin() + static_cast<std::ptrdiff_t>(count));
    EXPECT_EQ(WithoutJumps(path).size(), count);
  }
}

}  // namespace
}  // namespace deepuav
