#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/estimation/solvers/block_cholesky.h"
#include "deepuav/inertial/chain/inertial_adjustment.h"

namespace deepuav {

/// J^T W J, J^T W r and the cost of an inertial problem at its states: neighbours alone are linked.
struct InertialChain {
  std::vector<double> hessian;  ///< As BlockCholesky takes it, of ChainPattern.
  Eigen::VectorXd gradient;
  std::vector<InertialMotion> motions;  ///< Of the states, for their steps.
  double cost = 0;
  double imu_chi_square = 0;  ///< Of the integrated motions, per residual.

  /// The Hessian with the diagonal of pose and velocity grown by this share. What walks is left
  /// alone: held to its neighbours far more tightly than to the measurements, it would not move.
  std::vector<double> Damped(double damping) const;
};

/// `states` blocks, each linked to the next.
BlockPattern ChainPattern(size_t states);

InertialChain Linearise(const InertialProblem& problem, const std::vector<InertialState>& states);

}  // namespace deepuav
