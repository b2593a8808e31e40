#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>

namespace deepuav {

/// J^T W J, J^T W r and the cost of a problem of few parameters at a state.
template <int kParameters>
struct NormalEquations {
  using Vector = Eigen::Matrix<double, kParameters, 1>;
  using Matrix = Eigen::Matrix<double, kParameters, kParameters>;

  Matrix hessian = Matrix::Zero();
  Vector gradient = Vector::Zero();
  double cost = 0;
};

struct DampedGaussNewtonTuning {
  static constexpr double kConvergedRelativeDecrease = 1e-9;
  static constexpr double kMinDamping = 1e-9;
  static constexpr double kInitialDamping = 1e-6;
  static constexpr double kMaxDamping = 1e6;
  static constexpr double kDampingFactor = 10;
};

/// Gauss-Newton, damped where a step would raise the cost (a bad prediction is far from the
/// quadratic bowl). `linearise(state)` gives NormalEquations, `move(state, step)` the state after a
/// step.
template <typename State, typename Linearise, typename Move>
State MinimiseDamped(State state, int iterations, const Linearise& linearise, const Move& move) {
  using Tuning = DampedGaussNewtonTuning;
  auto equations = linearise(state);
  using Equations = decltype(equations);
  double damping = Tuning::kInitialDamping;
  for (int i = 0; i < iterations && damping <= Tuning::kMaxDamping; ++i) {
    typename Equations::Matrix damped = equations.hessian;
    damped.diagonal() *= 1 + damping;
    const Eigen::LLT<typename Equations::Matrix> factor(damped);
    const typename Equations::Vector step = factor.solve(-equations.gradient);
    if (factor.info() != Eigen::Success || !step.allFinite()) {
      damping *= Tuning::kDampingFactor;
      continue;
    }
    const State candidate = move(state, step);
    const Equations next = linearise(candidate);
    if (!(next.cost <= equations.cost)) {
      damping *= Tuning::kDampingFactor;
      continue;
    }
    const bool converged =
        equations.cost - next.cost <= Tuning::kConvergedRelativeDecrease * equations.cost;
    state = candidate;
    equations = next;
    damping = std::max(damping / Tuning::kDampingFactor, Tuning::kMinDamping);
    if (converged) break;
  }
  return state;
}

}  // namespace deepuav
