#include "deepuav/estimation/model_noise.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/options.h"

namespace deepuav {
namespace {

constexpr double kMedianChiSquare = 1.3862943611198906;  // of two degrees of freedom: 2 ln 2
constexpr int kBisections = 12;

double MedianSquared(const std::vector<AdjustedResidual>& residuals, double sigma_px,
                     std::vector<double>* squared) {
  squared->clear();
  for (const AdjustedResidual& residual : residuals) {
    const Whitening whitening(residual.noise.Plus(sigma_px));
    squared->push_back((whitening * residual.error_px).squaredNorm() / residual.redundancy);
  }
  const auto middle = squared->begin() + static_cast<std::ptrdiff_t>(squared->size() / 2);
  std::nth_element(squared->begin(), middle, squared->end());
  return *middle;
}

}  // namespace

void ModelNoiseOptions::Check() const {
  CheckOption(min_sigma_px >= 0 && min_sigma_px <= 100, "mapping.model_noise.min_sigma_px",
              min_sigma_px, "0 to 100");
  CheckOption(max_sigma_px > min_sigma_px && max_sigma_px <= 100,
              "mapping.model_noise.max_sigma_px", max_sigma_px, "above min_sigma_px, at most 100");
  CheckOption(initial_sigma_px >= min_sigma_px && initial_sigma_px <= max_sigma_px,
              "mapping.model_noise.initial_sigma_px", initial_sigma_px,
              "min_sigma_px to max_sigma_px");
  CheckOption(weight >= 0 && weight <= 1, "mapping.model_noise.weight", weight, "0 to 1");
  CheckRange("mapping.model_noise.max_residuals", max_residuals, 10, 1'000'000);
  CheckRange("mapping.model_noise.min_residuals", min_residuals, 1, 1'000'000);
}

double EstimateModelSigma(const std::vector<AdjustedResidual>& residuals,
                          const ModelNoiseOptions& options) {
  if (residuals.empty()) return options.min_sigma_px;
  std::vector<double> squared;
  squared.reserve(residuals.size());
  double low = options.min_sigma_px, high = options.max_sigma_px;
  if (MedianSquared(residuals, low, &squared) <= kMedianChiSquare) return low;
  if (MedianSquared(residuals, high, &squared) >= kMedianChiSquare) return high;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (MedianSquared(residuals, middle, &squared) > kMedianChiSquare ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace deepuav
