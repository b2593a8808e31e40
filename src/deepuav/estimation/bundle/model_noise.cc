#include "deepuav/estimation/bundle/model_noise.h"

#include <algorithm>

#include "deepuav/base/option_check.h"

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

void ModelNoiseOptions::Check() const { CheckOptions("mapping.model_noise", *this); }

void ModelNoiseOptions::CheckRelations() const {
  CheckOption(max_sigma_px > min_sigma_px, "max_sigma_px", max_sigma_px, "more than min_sigma_px");
  CheckOption(initial_sigma_px >= min_sigma_px && initial_sigma_px <= max_sigma_px,
              "initial_sigma_px", initial_sigma_px, "min_sigma_px to max_sigma_px");
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
