#include "deepuav/inertial/chain/inertial_adjustment.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "deepuav/estimation/solvers/block_cholesky.h"
#include "deepuav/inertial/chain/inertial_chain.h"

namespace deepuav {
namespace {

struct Tuning {
  static constexpr double kInitialDamping = 1e-7, kMinDamping = 1e-10, kMaxDamping = 1e6;
  static constexpr double kDampingFactor = 10;
  static constexpr double kConvergedRelativeDecrease = 1e-6;
  /// The cost is in squared standard deviations: so little more tells nothing.
  static constexpr double kConvergedDecrease = 0.01, kNegligibleDecrease = 0.1;
};

std::vector<InertialState> Moved(const InertialChain& chain,
                                 const std::vector<InertialState>& states,
                                 const Eigen::VectorXd& step) {
  std::vector<InertialState> moved;
  moved.reserve(states.size());
  for (size_t k = 0; k < states.size(); ++k) {
    moved.push_back(Moved(states[k], step.segment<kStateSize>(kStateSize * static_cast<int>(k)),
                          chain.motions[k]));
  }
  return moved;
}

}  // namespace

InertialFit AdjustInertial(const InertialProblem& problem, int iterations,
                           std::vector<InertialState>* states) {
  BlockCholesky<kStateSize> factor(ChainPattern(problem.size()));
  InertialChain chain = Linearise(problem, *states);
  double damping = Tuning::kInitialDamping;
  InertialFit fit;
  for (int i = 0; i < iterations && damping <= Tuning::kMaxDamping && !fit.converged; ++i) {
    Eigen::VectorXd step = -chain.gradient;
    if (!factor.Factorise(chain.Damped(damping).data())) {
      damping *= Tuning::kDampingFactor;
      continue;
    }
    factor.SolveInPlace(&step);
    const std::vector<InertialState> candidate = Moved(chain, *states, step);
    InertialChain next = Linearise(problem, candidate);
    const double expected = -chain.gradient.dot(step), decrease = chain.cost - next.cost;
    if (!step.allFinite() || !(decrease >= 0)) {
      fit.converged = expected <= Tuning::kNegligibleDecrease;
      damping *= Tuning::kDampingFactor;
      continue;
    }
    fit.converged = decrease <= std::max(Tuning::kConvergedDecrease,
                                         Tuning::kConvergedRelativeDecrease * chain.cost);
    *states = candidate;
    chain = std::move(next);
    damping = std::max(damping / Tuning::kDampingFactor, Tuning::kMinDamping);
  }
  fit.cost = chain.cost;
  fit.imu_chi_square = chain.imu_chi_square;
  return fit;
}

std::optional<InertialCovariance> CovarianceOf(const InertialProblem& problem,
                                               const std::vector<InertialState>& states,
                                               const std::vector<double>& scale_weights) {
  BlockCholesky<kStateSize> factor(ChainPattern(problem.size()));
  const InertialChain chain = Linearise(problem, states);
  if (!factor.Factorise(chain.hessian.data())) return std::nullopt;
  // The functions asked for, as rows of their derivatives: mean scale, gravity and clock offset.
  constexpr int kScale = 0, kLevel = 1, kOffset = 3, kFunctions = 4;
  using Functions = Eigen::Matrix<double, Eigen::Dynamic, kFunctions>;
  Functions functions = Functions::Zero(chain.gradient.size(), kFunctions);
  const double share = 1 / static_cast<double>(states.size());
  for (size_t k = 0; k < states.size(); ++k) {
    const auto row = kStateSize * static_cast<Eigen::Index>(k);
    functions(row + kLogScaleOfMap, kScale) = scale_weights[k];
    functions.block<2, 2>(row + kDown, kLevel) =
        share * AxesAcross(states[0].down).transpose() * AxesAcross(states[k].down);
    functions(row + kClock, kOffset) = share;
  }
  Functions solved = functions;
  factor.SolveInPlace(&solved);
  const Eigen::Matrix<double, kFunctions, kFunctions> covariance = functions.transpose() * solved;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> level(
      Eigen::Matrix2d(covariance.block<2, 2>(kLevel, kLevel)));
  InertialCovariance result;
  result.log_scale_sigma = std::sqrt(covariance(kScale, kScale));
  result.down_sigma_rad = std::sqrt(level.eigenvalues().maxCoeff());
  result.clock_sigma_s = std::sqrt(covariance(kOffset, kOffset));
  return result;
}

}  // namespace deepuav
