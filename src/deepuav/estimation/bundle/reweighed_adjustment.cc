#include "deepuav/estimation/bundle/reweighed_adjustment.h"

#include <algorithm>

#include "deepuav/base/option_check.h"
#include "deepuav/estimation/bundle/student_errors.h"

namespace deepuav {
namespace {

/// A landmark's errors are known as if it had been seen once more, with this sum.
constexpr double kPriorSquaredError = 1;
constexpr double kPriorFreedom = 1.5;
/// An outlier must not take the weight of its landmark's other observations with it...
constexpr double kLargestSharedError = 8;
/// ...and counts nothing from here on.
constexpr double kLargestOwnError = 1e4;

std::vector<double> MeanErrorsOfLandmarks(std::span<const double> squared_errors,
                                          std::span<const int> landmarks) {
  const int count =
      landmarks.empty() ? 0 : *std::max_element(landmarks.begin(), landmarks.end()) + 1;
  std::vector<double> sums(static_cast<size_t>(count)), numbers(static_cast<size_t>(count));
  for (size_t i = 0; i < landmarks.size(); ++i) {
    const auto landmark = static_cast<size_t>(landmarks[i]);
    sums[landmark] += std::min(squared_errors[i], kLargestSharedError);
    numbers[landmark] += 2;
  }
  for (size_t landmark = 0; landmark < sums.size(); ++landmark) {
    const double freedom = std::max(numbers[landmark] - 3, 0.0) + kPriorFreedom;
    sums[landmark] = (sums[landmark] + kPriorSquaredError) / freedom;
  }
  return sums;
}

PixelNoise Over(const PixelNoise& noise, double weight) {
  return PixelNoise(Eigen::Matrix2d(noise.Covariance() / weight));
}

std::vector<int> LandmarksOf(const BundleProblem& problem) {
  std::vector<int> landmarks;
  for (const BundleObservation& observation : problem.observations)
    landmarks.push_back(observation.landmark);
  return landmarks;
}

using WeightsOfErrors = std::function<std::vector<double>(std::span<const double>)>;

/// As the options say in the last round, with fewer steps in those before.
BundleReport AdjustInRounds(BundleProblem* problem, const BundleOptions& options, int rounds,
                            int round_iterations, const WeightsOfErrors& weights_of,
                            const std::function<bool()>& stop) {
  const std::vector<BundleObservation> stated = problem->observations;
  BundleOptions of_round = options;
  of_round.max_iterations = std::min(options.max_iterations, round_iterations);
  BundleReport report;
  for (int round = 0; round < rounds && !(stop && stop()); ++round) {
    problem->observations = stated;
    const std::vector<double> weights = weights_of(SquaredErrors(*problem));
    for (size_t i = 0; i < weights.size(); ++i)
      problem->observations[i].noise = Over(stated[i].noise, weights[i]);
    const bool is_last = round + 1 == rounds;
    report = AdjustBundle(problem, is_last ? options : of_round, stop);
  }
  problem->observations = stated;
  report.outlier.clear();
  for (const double error : SquaredErrors(*problem))
    report.outlier.push_back(!(error <= options.chi_square));
  return report;
}

}  // namespace

void ReweighingOptions::Check() const { CheckOptions("mapping.reweighing", *this); }
void TailOptions::Check() const { CheckOptions("survey.tails", *this); }

std::vector<double> WeightsByErrors(std::span<const double> squared_errors,
                                    std::span<const int> landmarks,
                                    const ReweighingOptions& options) {
  const std::vector<double> of_landmarks = MeanErrorsOfLandmarks(squared_errors, landmarks);
  std::vector<double> weights;
  double sum = 0;
  for (size_t i = 0; i < squared_errors.size(); ++i) {
    const double own = 1 + std::min(squared_errors[i], kLargestOwnError) / options.quarter_at;
    const double shared =
        1 + of_landmarks[static_cast<size_t>(landmarks[i])] / options.landmark_half_at;
    weights.push_back(1 / (own * own * shared));
    sum += weights.back();
  }
  for (double& weight : weights) weight *= static_cast<double>(weights.size()) / sum;
  return weights;
}

BundleReport AdjustReweighed(BundleProblem* problem, const BundleOptions& options,
                             const ReweighingOptions& reweighing,
                             const std::function<bool()>& stop) {
  if (reweighing.rounds == 0 || problem->observations.empty())
    return AdjustBundle(problem, options, stop);
  const std::vector<int> landmarks = LandmarksOf(*problem);
  return AdjustInRounds(
      problem, options, reweighing.rounds, reweighing.round_iterations,
      [&](std::span<const double> errors) {
        return WeightsByErrors(errors, landmarks, reweighing);
      },
      stop);
}

BundleReport AdjustByTails(BundleProblem* problem, const BundleOptions& options,
                           const TailOptions& tails, const std::function<bool()>& stop) {
  if (tails.rounds == 0 || problem->observations.empty())
    return AdjustBundle(problem, options, stop);
  return AdjustInRounds(
      problem, options, tails.rounds, options.max_iterations,
      [&](std::span<const double> errors) { return StudentWeights(errors, tails.min_freedom); },
      stop);
}

}  // namespace deepuav
