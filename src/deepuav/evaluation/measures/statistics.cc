#include "deepuav/evaluation/measures/statistics.h"

#include <algorithm>
#include <cmath>

namespace deepuav {

ErrorStatistics ComputeStatistics(const std::vector<double>& errors) {
  ErrorStatistics statistics;
  if (errors.empty()) return statistics;
  statistics.count = static_cast<int>(errors.size());
  const auto count = static_cast<double>(errors.size());

  double sum = 0;
  for (const double error : errors) {
    sum += error;
    statistics.sse += error * error;
  }
  statistics.mean = sum / count;
  statistics.rmse = std::sqrt(statistics.sse / count);

  double squared_deviations = 0;
  for (const double error : errors) {
    squared_deviations += (error - statistics.mean) * (error - statistics.mean);
  }
  statistics.std = std::sqrt(squared_deviations / count);

  std::vector<double> sorted = errors;
  std::sort(sorted.begin(), sorted.end());
  statistics.min = sorted.front();
  statistics.max = sorted.back();
  const size_t middle = sorted.size() / 2;
  statistics.median =
      sorted.size() % 2 == 1 ? sorted[middle] : 0.5 * (sorted[middle - 1] + sorted[middle]);
  return statistics;
}

}  // namespace deepuav
