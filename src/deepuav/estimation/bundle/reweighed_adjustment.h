#pragma once

#include <functional>
#include <span>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/bundle/bundle_adjustment.h"

namespace deepuav {

/// How much an observation counts by what its error and those of its landmark show. Positions of
/// patches err with longer tails than a normal distribution has: at edges of depth, in shadows, on
/// what repeats itself, and such a landmark errs in all its views.
struct ReweighingOptions {
  int rounds = 4;                 ///< Of weighing and adjusting; 0: all count as stated.
  double quarter_at = 1;          ///< Squared error, in sigmas, of an observation of weight 1/4.
  double landmark_half_at = 0.5;  ///< Mean squared error of a landmark of weight 1/2.
  int round_iterations = 8;       ///< Steps of a round but the last.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("rounds", rounds, "",
          "adjustments of a whole map in which observations count by how well they fit; 0: none",
          Between(0, 50));
    visit("quarter_at", quarter_at, "",
          "squared error in standard deviations of an observation that counts a quarter",
          Above(0, 1e6));
    visit("landmark_half_at", landmark_half_at, "",
          "mean squared error of a landmark whose observations count half", Above(0, 1e6));
    visit("round_iterations", round_iterations, "", "most Levenberg-Marquardt steps of a round",
          Between(1, 200));
  }
};

/// How much an observation counts by how long the tails of all errors are.
struct TailOptions {
  int rounds = 3;          ///< Of weighing and adjusting; 0: all count as stated.
  double min_freedom = 2;  ///< Degrees of freedom of Student's t distribution, at least.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("rounds", rounds, "",
          "adjustments in which observations count by how well they fit; 0: none", Between(0, 50));
    visit("min_freedom", min_freedom, "",
          "degrees of freedom of Student's t distribution of errors, at least: how long tails may "
          "be",
          Between(0.5, 1000));
  }
};

/// The weights of observations with these squared errors, in standard deviations, of the
/// landmarks, one each: those of Geman and McClure (1987) by an observation's own error times
/// those of Cauchy by its landmark's, with a mean of 1, so that all together they count as stated.
std::vector<double> WeightsByErrors(std::span<const double> squared_errors,
                                    std::span<const int> landmarks,
                                    const ReweighingOptions& options);

/// Iteratively reweighted least squares: AdjustBundle, again and again, with the noise that is
/// stated of each observation over its weight. The problem keeps the noises as stated, and so are
/// the report's outliers. To be started where most fits already.
BundleReport AdjustReweighed(BundleProblem* problem, const BundleOptions& options,
                             const ReweighingOptions& reweighing,
                             const std::function<bool()>& stop = nullptr);

/// The same with the weights of FitStudentErrors, which are all 1 where errors are normal.
BundleReport AdjustByTails(BundleProblem* problem, const BundleOptions& options,
                           const TailOptions& tails, const std::function<bool()>& stop = nullptr);

}  // namespace deepuav
