#include "deepuav/simulation/flight/minimum_snap_curve.h"

#include <Eigen/LU>
#include <Eigen/SparseLU>
#include <algorithm>
#include <array>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr int kDegree = 7;
constexpr int kEndOrders = 4;      // value, velocity, acceleration and jerk fix a piece at an end
constexpr int kUnknownOrders = 3;  // all but the value are unknown at inner knots

// (d/du)^order of u^power at u = 1: power! / (power - order)!.
double PowerDerivative(int power, int order) {
  double product = 1;
  for (int i = 0; i < order; ++i) product *= power - i;
  return product;
}

// Rows: coefficients 4 to 7 of a piece on [0, 1]; columns: value and first three derivatives by u
// at 0, then at 1.
Eigen::Matrix<double, 4, 8> MakeHermiteRows() {
  Eigen::Matrix4d at_end;
  Eigen::Matrix<double, 4, 8> residual = Eigen::Matrix<double, 4, 8>::Zero();
  for (int order = 0; order < kEndOrders; ++order) {
    for (int k = 0; k < 4; ++k) at_end(order, k) = PowerDerivative(k + 4, order);
    residual(order, kEndOrders + order) = 1;
    for (int k = order; k < kEndOrders; ++k)
      residual(order, k) = -PowerDerivative(k, order) / PowerDerivative(k, k);
  }
  return at_end.inverse() * residual;
}

const Eigen::Matrix<double, 4, 8>& HermiteRows() {
  static const Eigen::Matrix<double, 4, 8> rows = MakeHermiteRows();
  return rows;
}

// The (4 + m)-th derivatives by u, m = 0, 1, 2, of a piece at 0 and at 1, as functions of the same
// columns.
using HighDerivatives = Eigen::Matrix<double, kUnknownOrders, 8>;

HighDerivatives HighAtStart() {
  HighDerivatives rows;
  for (int m = 0; m < kUnknownOrders; ++m)
    rows.row(m) = PowerDerivative(4 + m, 4 + m) * HermiteRows().row(m);
  return rows;
}

HighDerivatives HighAtEnd() {
  HighDerivatives rows = HighDerivatives::Zero();
  for (int m = 0; m < kUnknownOrders; ++m) {
    for (int power = 4 + m; power <= kDegree; ++power)
      rows.row(m) += PowerDerivative(power, 4 + m) * HermiteRows().row(power - 4);
  }
  return rows;
}

// Velocity, acceleration and jerk of one knot, in rows.
using KnotDerivatives = Eigen::Matrix<double, kUnknownOrders, 4>;

// Adds `sign` times the derivatives 4 to 6 by time of one piece to the equations from `row` on.
// `knot` is the piece's first; inner knot i has the unknowns from kUnknownOrders * (i - 1) on.
void AddContinuity(const HighDerivatives& high, double h, double sign, int row, int knot,
                   const std::vector<FlatOutput>& values,
                   std::vector<Eigen::Triplet<double>>* matrix, Eigen::MatrixXd* right) {
  const int last_knot = static_cast<int>(values.size()) - 1;
  std::array<double, kDegree + 1> power_of_h{1};
  for (int i = 1; i <= kDegree; ++i)
    power_of_h[static_cast<size_t>(i)] = power_of_h[static_cast<size_t>(i) - 1] * h;
  for (int m = 0; m < kUnknownOrders; ++m) {
    const double scale = sign / power_of_h[static_cast<size_t>(4 + m)];
    for (int end = 0; end < 2; ++end) {
      const int at = knot + end;
      right->row(row + m) -=
          scale * high(m, kEndOrders * end) * values[static_cast<size_t>(at)].transpose();
      if (at == 0 || at == last_knot) continue;  // at rest
      for (int order = 1; order < kEndOrders; ++order) {
        matrix->emplace_back(
            row + m, kUnknownOrders * (at - 1) + order - 1,
            scale * high(m, kEndOrders * end + order) * power_of_h[static_cast<size_t>(order)]);
      }
    }
  }
}

std::vector<KnotDerivatives> SolveDerivatives(const std::vector<double>& times_s,
                                              const std::vector<FlatOutput>& values) {
  const int knots = static_cast<int>(values.size());
  std::vector<KnotDerivatives> derivatives(values.size(), KnotDerivatives::Zero());
  const int unknowns = kUnknownOrders * (knots - 2);
  if (unknowns == 0) return derivatives;
  std::vector<Eigen::Triplet<double>> entries;  // of a matrix of blocks about its diagonal
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(unknowns, 4);
  const HighDerivatives at_start = HighAtStart(), at_end = HighAtEnd();
  for (int i = 1; i + 1 < knots; ++i) {
    const auto knot = static_cast<size_t>(i);
    const int row = kUnknownOrders * (i - 1);
    AddContinuity(at_end, times_s[knot] - times_s[knot - 1], 1, row, i - 1, values, &entries,
                  &right);
    AddContinuity(at_start, times_s[knot + 1] - times_s[knot], -1, row, i, values, &entries,
                  &right);
  }
  Eigen::SparseMatrix<double> matrix(unknowns, unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseLU<Eigen::SparseMatrix<double>> solver(matrix);
  const Eigen::MatrixXd solution = solver.solve(right);
  for (int i = 1; i + 1 < knots; ++i)
    derivatives[static_cast<size_t>(i)] =
        solution.middleRows<kUnknownOrders>(kUnknownOrders * (i - 1));
  return derivatives;
}

}  // namespace

MinimumSnapCurve::MinimumSnapCurve(std::vector<double> times_s,
                                   const std::vector<FlatOutput>& values)
    : times_s_(std::move(times_s)) {
  if (times_s_.size() < 2 || times_s_.size() != values.size()) {
    throw Error("a curve of {} times and {} values: expected at least two of each", times_s_.size(),
                values.size());
  }
  for (size_t i = 1; i < times_s_.size(); ++i) {
    if (!(times_s_[i] > times_s_[i - 1]))
      throw Error("a curve's time {} s follows {} s: expected growing times", times_s_[i],
                  times_s_[i - 1]);
  }
  const std::vector<KnotDerivatives> derivatives = SolveDerivatives(times_s_, values);
  pieces_.resize(values.size() - 1);
  for (size_t i = 0; i < pieces_.size(); ++i) {
    const double h = times_s_[i + 1] - times_s_[i];
    Eigen::Matrix<double, 8, 4> ends;  // by u, as HermiteRows() takes them
    for (int end = 0; end < 2; ++end) {
      const size_t knot = i + static_cast<size_t>(end);
      ends.row(kEndOrders * end) = values[knot].transpose();
      double power = 1;
      for (int order = 1; order < kEndOrders; ++order) {
        power *= h;
        ends.row(kEndOrders * end + order) = power * derivatives[knot].row(order - 1);
      }
    }
    for (int k = 0; k < kEndOrders; ++k)
      pieces_[i].col(k) = ends.row(k).transpose() / PowerDerivative(k, k);
    pieces_[i].rightCols<4>() = (HermiteRows() * ends).transpose();
  }
}

FlatState MinimumSnapCurve::At(double time_s) const {
  const double t = std::clamp(time_s, start_s(), end_s());
  const auto after = std::upper_bound(times_s_.begin() + 1, times_s_.end() - 1, t);
  const auto i = static_cast<size_t>(after - times_s_.begin()) - 1;
  const double h = times_s_[i + 1] - times_s_[i];
  const double u = (t - times_s_[i]) / h;
  const Piece& piece = pieces_[i];
  FlatState state;
  for (int k = kDegree; k >= 0; --k) {  // Horner's rule, for the derivatives as well
    state.jerk = state.jerk * u + 3 * state.acceleration;
    state.acceleration = state.acceleration * u + 2 * state.velocity;
    state.velocity = state.velocity * u + state.value;
    state.value = state.value * u + piece.col(k);
  }
  state.velocity /= h;
  state.acceleration /= h * h;
  state.jerk /= h * h * h;
  return state;
}

}  // namespace deepuav
