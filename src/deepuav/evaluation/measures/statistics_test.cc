#include "deepuav/evaluation/measures/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace deepuav {
namespace {

TEST(Statistics, OfKnownErrors) {
  const ErrorStatistics statistics = ComputeStatistics({4, 1, 3, 2});
  EXPECT_EQ(statistics.count, 4);
  EXPECT_DOUBLE_EQ(statistics.mean, 2.5);
  EXPECT_DOUBLE_EQ(statistics.median, 2.5);
  EXPECT_DOUBLE_EQ(statistics.min, 1);
  EXPECT_DOUBLE_EQ(statistics.max, 4);
  EXPECT_DOUBLE_EQ(statistics.sse, 30);
  EXPECT_DOUBLE_EQ(statistics.rmse, std::sqrt(7.5));
  EXPECT_DOUBLE_EQ(statistics.std, std::sqrt(1.25));
}

TEST(Statistics, MedianOfAnOddCountIsTheMiddle) {
  EXPECT_DOUBLE_EQ(ComputeStatistics({9, 1, 2}).median, 2);
}

TEST(Statistics, NoErrorsAreZero) {
  EXPECT_EQ(ComputeStatistics({}).count, 0);
  EXPECT_EQ(ComputeStatistics({}).rmse, 0);
}

}  // namespace
}  // namespace deepuav
