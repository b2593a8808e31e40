#pragma once

#include <span>
#include <vector>

namespace deepuav {

/// Student's t distribution of two-dimensional errors (Lange, Little and Taylor 1989): the fewer
/// its degrees of freedom, the longer its tails.
struct StudentErrors {
  double freedom = 0;
  double variance = 1;  ///< Of its middle, along each axis.

  /// The weight of an error of this square by which least squares become most likely estimates.
  double Weight(double squared_error) const;
};

/// The most probable one of errors with these squares. Where they are normal, it has so many
/// degrees of freedom that all weights are nearly 1. At least one error; no fewer than
/// `min_freedom`.
StudentErrors FitStudentErrors(std::span<const double> squared_errors, double min_freedom);

/// Of errors with these squares, with a mean of 1.
std::vector<double> StudentWeights(std::span<const double> squared_errors, double min_freedom);

}  // namespace deepuav
