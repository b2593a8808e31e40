#include "deepuav/matching/best_two_scan.h"

#include <gtest/gtest.h>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

/// One value after the other, as the header promises.
BestTwoOfMatrix OneByOne(const std::vector<float>& matrix, size_t rows, size_t columns) {
  BestTwoOfMatrix expected{std::vector<BestTwo>(rows), std::vector<BestTwo>(columns)};
  for (size_t i = 0; i < rows; ++i) {
    for (size_t j = 0; j < columns; ++j) {
      expected.of_rows[i].Offer(static_cast<int>(j), matrix[i * columns + j]);
      expected.of_columns[j].Offer(static_cast<int>(i), matrix[i * columns + j]);
    }
  }
  return expected;
}

void ExpectSame(const std::vector<BestTwo>& found, const std::vector<BestTwo>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (size_t k = 0; k < found.size(); ++k) {
    EXPECT_EQ(found[k].index, expected[k].index) << k;
    EXPECT_EQ(found[k].first, expected[k].first) << k;
    EXPECT_EQ(found[k].second, expected[k].second) << k;
  }
}

/// With few levels many values are equal; every eighth or so is below any similarity.
std::vector<float> RandomMatrix(size_t count, int levels, uint64_t seed) {
  Random random(seed);
  std::vector<float> matrix(count);
  for (float& value : matrix) {
    const int level = random.Index(levels + levels / 8 + 1);
    value =
        level >= levels ? -2.0f : 2 * static_cast<float>(level) / static_cast<float>(levels) - 1;
  }
  return matrix;
}

TEST(BestTwoScan, FindsWhatOfferingOneByOneFinds) {
  uint64_t seed = 1;
  for (const auto& [rows, columns] : {std::pair<size_t, size_t>{1, 1},
                                      {3, 7},
                                      {5, 8},
                                      {9, 16},
                                      {2, 17},
                                      {40, 31},
                                      {1, 64},
                                      {64, 1}}) {
    for (int levels : {1, 2, 5, 1000}) {
      const std::vector<float> matrix = RandomMatrix(rows * columns, levels, seed++);
      const BestTwoOfMatrix found = FindBestTwo(matrix, rows, columns);
      const BestTwoOfMatrix expected = OneByOne(matrix, rows, columns);
      SCOPED_TRACE(testing::Message() << rows << " x " << columns << ", " << levels << " levels");
      ExpectSame(found.of_rows, expected.of_rows);
      ExpectSame(found.of_columns, expected.of_columns);
    }
  }
}

TEST(BestTwo, WhatIsEquallyNearDoesNotPass) {
  constexpr double kRatio = 0.95;
  const auto passes = [](float first, float second) {
    return BestTwo{0, first, second}.PassesRatio(kRatio);
  };
  for (const float repeated : {0.6F, 0.999F, 1.0F, 1.001F})
    EXPECT_FALSE(passes(repeated, repeated));
  EXPECT_FALSE(passes(1.002F, 1.001F)) << "of rounding alone";
  EXPECT_TRUE(passes(1.001F, 0.9F));
  EXPECT_TRUE(passes(0.9F, 0.8F));
  EXPECT_FALSE(passes(0.9F, 0.895F));
  EXPECT_TRUE((BestTwo{0, 0.1F}).PassesRatio(kRatio)) << "without a second";
  EXPECT_TRUE((BestTwo{0, 0.9F, 0.9F}).PassesRatio(1)) << "no test";
}

TEST(BestTwoScan, AMatrixWithoutColumnsHasNoBest) {
  const BestTwoOfMatrix found = FindBestTwo({}, 3, 0);
  ASSERT_EQ(found.of_rows.size(), 3u);
  EXPECT_EQ(found.of_rows[1].index, -1);
  EXPECT_TRUE(found.of_columns.empty());
}

}  // namespace
}  // namespace deepuav
