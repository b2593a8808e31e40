#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/pixel_noise.h"

namespace deepuav {

struct ModelNoiseOptions {
  double initial_sigma_px = 0.3;  ///< Before anything was measured.
  double min_sigma_px = 0.02;
  double max_sigma_px = 2;
  double weight = 0.3;       ///< Of a new estimate beside what was known.
  int max_residuals = 2000;  ///< Looked at for one estimate.
  int min_residuals = 100;   ///< Fewer tell nothing.

  void Check() const;
  /// Throws OptionError where two options contradict each other.
  void CheckRelations() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("initial_sigma_px", initial_sigma_px, "px",
          "standard deviation of what calibration and shutter add to measurements, to begin with",
          Between(0, 100));
    visit("min_sigma_px", min_sigma_px, "px", "least standard deviation that is assumed of it",
          Between(0, 100));
    visit("max_sigma_px", max_sigma_px, "px", "largest standard deviation that is assumed of it",
          Above(0, 100));
    visit("weight", weight, "", "of a new estimate of it beside what was known", Between(0, 1));
    visit("max_residuals", max_residuals, "", "reprojection errors looked at for one estimate",
          Between(10, 1'000'000));
    visit("min_residuals", min_residuals, "",
          "reprojection errors below which nothing is estimated", Between(1, 1'000'000));
  }
};

/// The reprojection error of an observation after adjustment.
struct AdjustedResidual {
  Eigen::Vector2d error_px;
  PixelNoise noise;  ///< Of the measurement alone.
  /// Share of the observation's variance that the adjustment left in the error: 1 - 3/(2 n) for a
  /// landmark seen n times, as three of its 2 n numbers went into its position.
  double redundancy = 1;
};

/// The standard deviation per axis of an error common to all, on top of each one's noise, under
/// which the median of the squared errors in standard deviations is that of a normal distribution.
/// Robust: up to half may be outliers. Within the bounds of the options; 0 residuals: the least.
double EstimateModelSigma(const std::vector<AdjustedResidual>& residuals,
                          const ModelNoiseOptions& options);

}  // namespace deepuav
