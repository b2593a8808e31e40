#include "deepuav/inertial/chain/inertial_adjustment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/inertial/chain/imu_factor.h"
#include "deepuav/inertial/chain/inertial_chain.h"
#include "support/inertial_flight.h"
#include "support/numeric_jacobian.h"

namespace deepuav {
namespace {

constexpr double kGravity = InertialFlight::kGravity_m_s2;
const SE3 kCamFromImu(RotationExp({1.2, -0.4, 0.3}), {0.1, -0.2, 0.05});
const Sim3 kWorldFromLevel(0.05, RotationExp({0.4, 0.2, -1}), {2, 1, -3});

/// The state that the flight has at a moment, in the camera's world.
InertialState StateAt(double t) {
  const InertialFlight flight;
  InertialState state;
  const Eigen::Quaterniond rotation = kWorldFromLevel.rotation();
  state.world_from_imu = rotation * flight.Rotation(t);
  state.camera = kWorldFromLevel * (flight.WorldFromImu(t) * kCamFromImu.InverseTranslation());
  state.velocity_m_s = rotation * flight.Velocity(t);
  state.log_scale = -std::log(kWorldFromLevel.scale());
  state.down = rotation * -Eigen::Vector3d::UnitZ();
  return state;
}

class InertialAdjustmentTest : public testing::Test {
 protected:
  InertialAdjustmentTest()
      : integrator_(InertialFlight().Samples(0, 8, 200), {1e-4, 1e-5, 2e-3, 1e-3}, 0.05) {
    problem_.imu = &integrator_;
    problem_.cam_from_imu = kCamFromImu;
    problem_.path = InertialFlight().CameraPath(1, 7, 10, kCamFromImu, kWorldFromLevel);
    problem_.turn_sigma_rad.assign(problem_.size(), 1e-3);
    problem_.position_sigma.assign(problem_.size(), 2e-4);
    problem_.LinkStates();
    for (size_t k = 0; k < problem_.size(); ++k)
      states_.push_back(StateAt(problem_.path[k].time.seconds()));
  }

  /// Every state moved a little, each another way.
  std::vector<InertialState> Disturbed(double by) {
    Random random(5);
    std::vector<InertialState> states = states_;
    for (InertialState& state : states) {
      StateStep step;
      for (double& value : step) value = random.Gaussian(by);
      step.segment<3>(kPosition) *= kWorldFromLevel.scale();
      step[kClock] = 0;
      state = Moved(state, step, {});
    }
    return states;
  }

  ImuIntegrator integrator_;
  InertialProblem problem_;
  std::vector<InertialState> states_;
};

TEST_F(InertialAdjustmentTest, TheTruthMissesNothing) {
  const auto motion = integrator_.Between(AtSeconds(1), AtSeconds(1.5), {});
  const ImuResidual residual =
      ResidualOf(StateAt(1), StateAt(1.5), *motion, problem_.camera_in_imu_m(), kGravity);
  EXPECT_LT(residual.value.cwiseAbs().maxCoeff(), 5e-5);
}

TEST_F(InertialAdjustmentTest, TheFactorsDerivativesAreRight) {
  const std::vector<InertialState> states = Disturbed(0.05);
  const InertialState &first = states[3], &last = states[6];
  const auto between = [&](const ImuBias& bias) {
    return *integrator_.Between(AtSeconds(1.3), AtSeconds(1.6), bias);
  };
  const auto value = [&](const StateStep& a, const StateStep& b) -> Eigen::VectorXd {
    const InertialState moved = Moved(first, a, {});
    return ResidualOf(moved, Moved(last, b, {}), between(moved.bias), problem_.camera_in_imu_m(),
                      kGravity)
        .value;
  };
  const ImuResidual residual =
      ResidualOf(first, last, between(first.bias), problem_.camera_in_imu_m(), kGravity);
  const StateStep still = StateStep::Zero();
  const Eigen::MatrixXd by_first = NumericJacobian(
      [&](const Eigen::VectorXd& delta) { return value(delta, still); }, kStateSize);
  const Eigen::MatrixXd by_last = NumericJacobian(
      [&](const Eigen::VectorXd& delta) { return value(still, delta); }, kStateSize);
  EXPECT_LT((residual.by_first - by_first).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT((residual.by_last - by_last).cwiseAbs().maxCoeff(), 1e-5);
}

TEST_F(InertialAdjustmentTest, TheGradientIsThatOfTheCost) {
  std::vector<InertialState> states = Disturbed(1e-3);
  const InertialChain chain = Linearise(problem_, states);
  for (const size_t k : {size_t{0}, size_t{7}, problem_.size() - 1}) {
    const Eigen::MatrixXd numeric = NumericJacobian(
        [&](const Eigen::VectorXd& delta) -> Eigen::VectorXd {
          std::vector<InertialState> moved = states;
          StateStep step = StateStep::Zero();
          step.head<kClock>() = delta;
          moved[k] = Moved(states[k], step, {});
          return Eigen::VectorXd::Constant(1, 0.5 * Linearise(problem_, moved).cost);
        },
        kClock, 1e-7);
    const Eigen::VectorXd analytic =
        chain.gradient.segment<kClock>(kStateSize * static_cast<Eigen::Index>(k));
    EXPECT_LT((numeric.transpose() - analytic).norm(), 1e-3 * analytic.norm()) << k;
  }
}

TEST_F(InertialAdjustmentTest, AChangeOfTheClockMovesAStateAlongItsMotion) {
  constexpr double kLater_s = 1e-3;
  const InertialState state = StateAt(2);
  const InertialMotion motion =
      MotionOf(state, *integrator_.At(AtSeconds(2)), problem_.camera_in_imu_m(), kGravity);
  StateStep step = StateStep::Zero();
  step[kClock] = -kLater_s;
  const InertialState moved = Moved(state, step, motion), expected = StateAt(2 + kLater_s);
  EXPECT_LT(moved.world_from_imu.angularDistance(expected.world_from_imu), 1e-6);
  EXPECT_LT((moved.camera - expected.camera).norm(), 1e-6);
  EXPECT_LT((moved.velocity_m_s - expected.velocity_m_s).norm(), 1e-5);
}

TEST_F(InertialAdjustmentTest, FindsBackFromADisturbedStart) {
  std::vector<InertialState> states = Disturbed(0.02);
  const InertialFit fit = AdjustInertial(problem_, 30, &states);
  EXPECT_TRUE(fit.converged);
  for (size_t k = 0; k < states.size(); ++k) {
    EXPECT_NEAR(states[k].log_scale, states_[k].log_scale, 2e-3);
    EXPECT_LT((states[k].down - states_[k].down).norm(), 2e-3);
    EXPECT_LT((states[k].velocity_m_s - states_[k].velocity_m_s).norm(), 0.02);
  }
}

TEST_F(InertialAdjustmentTest, ACoarserPathTellsLess) {
  const std::vector<double> weights(problem_.size(), 1.0 / static_cast<double>(problem_.size()));
  const auto fine = CovarianceOf(problem_, states_, weights);
  for (double& sigma : problem_.position_sigma) sigma *= 10;
  const auto coarse = CovarianceOf(problem_, states_, weights);
  ASSERT_TRUE(fine && coarse);
  EXPECT_GT(coarse->log_scale_sigma, 3 * fine->log_scale_sigma);
  EXPECT_GT(fine->log_scale_sigma, 0);
}

}  // namespace
}  // namespace deepuav
