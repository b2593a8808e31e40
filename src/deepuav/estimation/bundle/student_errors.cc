#include "deepuav/estimation/bundle/student_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace deepuav {
namespace {

constexpr double kAxes = 2;
/// The tails differ by little between one and the next; the last is as good as normal.
constexpr double kFreedoms[] = {1, 1.5, 2, 3, 4, 6, 8, 12, 20, 50, 1000};
constexpr int kIterations = 30;
/// A point behind its camera must not carry the variance away.
constexpr double kLargestSquare = 1e4;

double Bounded(double squared_error) {
  return squared_error <= kLargestSquare ? squared_error : kLargestSquare;
}

double VarianceWith(double freedom, std::span<const double> squared_errors) {
  StudentErrors errors{freedom, 1};
  for (int i = 0; i < kIterations; ++i) {
    double sum = 0;
    for (const double square : squared_errors) sum += Bounded(square) * errors.Weight(square);
    errors.variance = std::max(sum / (kAxes * static_cast<double>(squared_errors.size())),
                               std::numeric_limits<double>::min());
  }
  return errors.variance;
}

double LogLikelihood(const StudentErrors& errors, std::span<const double> squared_errors) {
  double sum = -static_cast<double>(squared_errors.size()) * std::log(errors.variance);
  for (const double square : squared_errors) {
    sum -= (errors.freedom + kAxes) / 2 *
           std::log1p(Bounded(square) / (errors.freedom * errors.variance));
  }
  return sum;
}

}  // namespace

double StudentErrors::Weight(double squared_error) const {
  return (freedom + kAxes) / (freedom + Bounded(squared_error) / variance);
}

StudentErrors FitStudentErrors(std::span<const double> squared_errors, double min_freedom) {
  StudentErrors best;
  double most = -std::numeric_limits<double>::infinity();
  for (const double listed : kFreedoms) {
    const double freedom = std::max(listed, min_freedom);
    if (freedom == best.freedom) continue;
    const StudentErrors errors{freedom, VarianceWith(freedom, squared_errors)};
    const double likelihood = LogLikelihood(errors, squared_errors);
    if (likelihood <= most) continue;
    most = likelihood;
    best = errors;
  }
  return best;
}

std::vector<double> StudentWeights(std::span<const double> squared_errors, double min_freedom) {
  const StudentErrors errors = FitStudentErrors(squared_errors, min_freedom);
  std::vector<double> weights;
  double sum = 0;
  for (const double square : squared_errors) {
    weights.push_back(errors.Weight(square));
    sum += weights.back();
  }
  for (double& weight : weights) weight *= static_cast<double>(weights.size()) / sum;
  return weights;
}

}  // namespace deepuav
