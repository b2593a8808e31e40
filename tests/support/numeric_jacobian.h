#pragma once

#include <Eigen/Core>

namespace deepuav {

/// d function / d parameters at parameters = 0 by central differences: for functions of a
/// perturbation. Columns are as many as `parameters`; the error is of the order of step^2.
template <typename Function>
Eigen::MatrixXd NumericJacobian(const Function& function, int parameters, double step = 1e-6) {
  Eigen::MatrixXd jacobian;
  for (int column = 0; column < parameters; ++column) {
    Eigen::VectorXd delta = Eigen::VectorXd::Zero(parameters);
    delta[column] = step;
    const Eigen::VectorXd plus = function(delta);
    delta[column] = -step;
    const Eigen::VectorXd minus = function(delta);
    if (jacobian.size() == 0) jacobian.resize(plus.size(), parameters);
    jacobian.col(column) = (plus - minus) / (2 * step);
  }
  return jacobian;
}

}  // namespace deepuav
