#pragma once

#include <vector>

namespace deepuav {

/// Statistics of errors, in the errors' unit (sse: its square).
struct ErrorStatistics {
  int count = 0;
  double rmse = 0, mean = 0, median = 0;
  double std = 0;  ///< Of the population: divided by count.
  double min = 0, max = 0;
  double sse = 0;  ///< Sum of squared errors.
};

/// All zero for no errors.
ErrorStatistics ComputeStatistics(const std::vector<double>& errors);

}  // namespace deepuav
