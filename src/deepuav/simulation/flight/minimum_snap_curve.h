#pragma once

#include <Eigen/Core>
#include <vector>

namespace deepuav {

/// x, y, z (m) and yaw (rad): the flat outputs of a quadrotor, from which and whose derivatives all
/// of its motion follows (Mellinger and Kumar, ICRA 2011).
using FlatOutput = Eigen::Vector4d;

/// Flat outputs with their derivatives by time: at one instant.
struct FlatState {
  FlatOutput value = FlatOutput::Zero();
  FlatOutput velocity = FlatOutput::Zero();
  FlatOutput acceleration = FlatOutput::Zero();
  FlatOutput jerk = FlatOutput::Zero();
};

/// The curve through given values at given times, at rest at both ends (velocity, acceleration and
/// jerk are zero), whose integral of squared snap is the least: a spline of degree 7 with six
/// continuous derivatives.
class MinimumSnapCurve {
 public:
  /// At least two knots, times growing. Throws Error otherwise.
  MinimumSnapCurve(std::vector<double> times_s, const std::vector<FlatOutput>& values);

  double start_s() const { return times_s_.front(); }
  double end_s() const { return times_s_.back(); }
  /// Before the start and after the end it rests.
  FlatState At(double time_s) const;

 private:
  static constexpr int kCoefficients = 8;
  using Piece = Eigen::Matrix<double, 4, kCoefficients>;  ///< Of powers of (t - t_i) / h_i.

  std::vector<double> times_s_;
  std::vector<Piece> pieces_;
};

}  // namespace deepuav
