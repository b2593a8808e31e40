#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "deepuav/features/superpoint_postprocessing.h"

namespace deepuav {
namespace {

std::vector<float> RandomLogits(int rows, int columns, double largest, uint64_t seed) {
  Random random(seed);
  std::vector<float> logits(static_cast<size_t>(kSuperPointLogits * rows * columns));
  for (float& value : logits) value = static_cast<float>(random.Uniform(-largest, largest));
  return logits;
}

TEST(LogitsToHeatMap, IsTheSoftmaxOfEachCell) {
  constexpr int kRows = 5, kColumns = 13;
  for (const double largest : {1.0, 20.0, 60.0}) {
    const auto logits = RandomLogits(kRows, kColumns, largest, 1);
    std::vector<float> map(kRows * kColumns * 64), scratch;
    LogitsToHeatMap(logits, kRows, kColumns, map, &scratch);
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        const auto logit = [&](int channel) {
          return double{
              logits[static_cast<size_t>((row * kColumns + column) * kSuperPointLogits + channel)]};
        };
        double sum = 0;
        for (int channel = 0; channel < kSuperPointLogits; ++channel)
          sum += std::exp(logit(channel));
        for (int channel = 0; channel < 64; ++channel) {
          const int x = 8 * column + channel % 8, y = 8 * row + channel / 8;
          const double expected = std::exp(logit(channel)) / sum;
          EXPECT_NEAR(map[static_cast<size_t>(y * 8 * kColumns + x)], expected,
                      1e-5 * expected + 1e-30);
        }
      }
    }
  }
}

TEST(LogitsToHeatMap, ValuesThatAreNotFiniteAreRefused) {
  std::vector<float> map(2 * 3 * 64), scratch;
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity()}) {
    for (const size_t place : {size_t{0}, size_t{64 * 6}, size_t{65 * 6 - 1}}) {
      auto logits = RandomLogits(2, 3, 5, 2);
      logits[place] = bad;
      EXPECT_THROW(LogitsToHeatMap(logits, 2, 3, map, &scratch), Error);
    }
  }
}

TEST(LogitsToHeatMap, OtherSizesAreRefused) {
  std::vector<float> map(2 * 3 * 64), scratch;
  EXPECT_THROW(LogitsToHeatMap(RandomLogits(2, 4, 5, 2), 2, 3, map, &scratch), Error);
  map.pop_back();
  EXPECT_THROW(LogitsToHeatMap(RandomLogits(2, 3, 5, 2), 2, 3, map, &scratch), Error);
}

}  // namespace
}  // namespace deepuav
