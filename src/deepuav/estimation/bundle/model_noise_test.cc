#include "deepuav/estimation/bundle/model_noise.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "support/options_with.h"

namespace deepuav {
namespace {

/// Errors of measurements good to `sigma_px`, with `model_px` on top; a share of them wild.
std::vector<AdjustedResidual> Residuals(double sigma_px, double model_px, double wild, int count) {
  Random random(11);
  std::vector<AdjustedResidual> residuals;
  const double total = std::hypot(sigma_px, model_px);
  for (int i = 0; i < count; ++i) {
    const double spread = random.Uniform(0, 1) < wild ? 20 : total;
    residuals.push_back({{random.Gaussian(spread), random.Gaussian(spread)}, sigma_px, 1});
  }
  return residuals;
}

TEST(ModelNoiseTest, FindsWhatIsOnTopOfTheMeasurements) {
  EXPECT_NEAR(EstimateModelSigma(Residuals(0.1, 0.3, 0, 4000), {}), 0.3, 0.02);
  EXPECT_NEAR(EstimateModelSigma(Residuals(0.5, 0.5, 0, 4000), {}), 0.5, 0.05);
}

TEST(ModelNoiseTest, OutliersHardlyMatter) {
  EXPECT_NEAR(EstimateModelSigma(Residuals(0.1, 0.3, 0.2, 4000), {}), 0.36, 0.05);
}

TEST(ModelNoiseTest, IsTheLeastWhereMeasurementsExplainAll) {
  const ModelNoiseOptions options;
  EXPECT_EQ(EstimateModelSigma(Residuals(0.2, 0, 0, 4000), {.min_sigma_px = 0.1}), 0.1);
  EXPECT_EQ(EstimateModelSigma({}, options), options.min_sigma_px);
}

TEST(ModelNoiseTest, IsBoundedAbove) {
  EXPECT_EQ(EstimateModelSigma(Residuals(0.2, 50, 0, 400), {}), ModelNoiseOptions{}.max_sigma_px);
}

TEST(ModelNoiseTest, RedundancyMakesUpForWhatTheAdjustmentTook) {
  std::vector<AdjustedResidual> residuals = Residuals(0.1, 0.3, 0, 4000);
  for (AdjustedResidual& residual : residuals) {
    residual.error_px *= std::sqrt(0.5);
    residual.redundancy = 0.5;
  }
  EXPECT_NEAR(EstimateModelSigma(residuals, {}), 0.3, 0.02);
}

TEST(ModelNoiseOptionsTest, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(ModelNoiseOptions().Check());
  EXPECT_THROW(OptionsWith(&ModelNoiseOptions::weight, 1.5).Check(), Error);
  EXPECT_THROW(OptionsWith(&ModelNoiseOptions::initial_sigma_px, 5.0).Check(), Error);
  EXPECT_THROW(OptionsWith(&ModelNoiseOptions::min_sigma_px, -1.0).Check(), Error);
}

}  // namespace
}  // namespace deepuav
