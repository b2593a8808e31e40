#include "deepuav/base/random.h"

#include <gtest/gtest.h>

#include <array>

namespace deepuav {
namespace {

constexpr int kSamples = 200000;

// The standard states the 10000th value of the engine for its default seed.
TEST(Random, IsTheSameOnEveryMachine) {
  Random random(5489);
  double value = 0;
  for (int i = 0; i < 10000; ++i) value = random.Uniform(0, 1);
  EXPECT_EQ(value, static_cast<double>(9981545732273789042u >> 11) * 0x1.0p-53);
}

TEST(Random, RepeatsForOneSeedAndDiffersForAnother) {
  Random a(3), b(3), c(4);
  int equal = 0;
  for (int i = 0; i < 1000; ++i) {
    const double value = a.Gaussian(2);
    EXPECT_EQ(value, b.Gaussian(2));
    equal += value == c.Gaussian(2);
  }
  EXPECT_EQ(equal, 0);
}

TEST(Random, IndexIsUniform) {
  Random random(1);
  std::array<int, 7> counts{};
  for (int i = 0; i < kSamples; ++i) {
    const int index = random.Index(7);
    ASSERT_GE(index, 0);
    ASSERT_LT(index, 7);
    ++counts[static_cast<size_t>(index)];
  }
  // Five standard deviations of a binomial count.
  for (const int count : counts) EXPECT_NEAR(count, kSamples / 7.0, 5 * std::sqrt(kSamples / 7.0));
  EXPECT_EQ(random.Index(1), 0);
}

TEST(Random, IndexCoversGreatBounds) {
  Random random(1);
  double sum = 0;
  for (int i = 0; i < kSamples; ++i) {
    const int index = random.Index(2147483647);
    ASSERT_GE(index, 0);
    sum += index / 2147483647.0;
  }
  EXPECT_NEAR(sum / kSamples, 0.5, 5 * std::sqrt(1 / 12.0 / kSamples));
}

TEST(Random, UniformStaysInItsRange) {
  Random random(2);
  double sum = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double value = random.Uniform(-2, 6);
    ASSERT_GE(value, -2);
    ASSERT_LT(value, 6);
    sum += value;
  }
  EXPECT_NEAR(sum / kSamples, 2, 5 * 8 * std::sqrt(1 / 12.0 / kSamples));
}

TEST(Random, GaussianHasTheNormalsMomentsAndTails) {
  Random random(3);
  double sum = 0, squares = 0, beyond_two_sigma = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double value = random.Gaussian(3);
    sum += value;
    squares += value * value;
    beyond_two_sigma += std::abs(value) > 6;
  }
  EXPECT_NEAR(sum / kSamples, 0, 5 * 3 / std::sqrt(kSamples));
  EXPECT_NEAR(squares / kSamples, 9, 5 * 9 * std::sqrt(2.0 / kSamples));
  EXPECT_NEAR(beyond_two_sigma / kSamples, 0.0455, 5 * std::sqrt(0.0455 / kSamples));
}

}  // namespace
}  // namespace deepuav
