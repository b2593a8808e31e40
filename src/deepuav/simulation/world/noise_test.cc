#include "deepuav/simulation/world/noise.h"

#include <gtest/gtest.h>

#include <cmath>

namespace deepuav {
namespace {

TEST(Noise, RepeatsWithItsPeriodAndNotBefore) {
  constexpr int kPeriod = 8;
  double difference = 0;
  for (int i = 0; i < 100; ++i) {
    const float x = 0.173f * static_cast<float>(i), y = 0.311f * static_cast<float>(i);
    EXPECT_NEAR(GradientNoise(x, y, kPeriod, 5),
                GradientNoise(x + kPeriod, y - kPeriod, kPeriod, 5), 1e-4);
    difference += std::abs(GradientNoise(x, y, 0, 5) - GradientNoise(x + kPeriod, y, 0, 5));
  }
  EXPECT_GT(difference, 10);
}

TEST(Noise, FractalHasTheStatedDeviationAndNoMean) {
  double sum = 0, squares = 0;
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) {
    const float x = UnitFromHash(HashCell(i, 0, 1)) * 64, y = UnitFromHash(HashCell(i, 1, 1)) * 64;
    const double value = FractalNoise(x, y, 0, 5, 0.9f, 3);
    sum += value;
    squares += value * value;
  }
  EXPECT_NEAR(sum / kCount, 0, 0.02);
  EXPECT_NEAR(std::sqrt(squares / kCount), 0.25, 0.06);
}

TEST(Noise, IsContinuousAcrossCellBorders) {
  for (int i = -20; i < 20; ++i) {
    const auto border = static_cast<float>(i);
    EXPECT_NEAR(GradientNoise(border - 1e-4f, 0.3f, 0, 2),
                GradientNoise(border + 1e-4f, 0.3f, 0, 2), 1e-3);
    const Eigen::Vector3f below(0.3f, border - 1e-4f, 0.7f), above(0.3f, border + 1e-4f, 0.7f);
    EXPECT_NEAR(GradientNoise(below, 2), GradientNoise(above, 2), 2e-3);
  }
}

}  // namespace
}  // namespace deepuav
