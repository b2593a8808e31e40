#include "deepuav/place/bag_of_words.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

TEST(Similarity, IsOneMinusHalfTheL1Distance) {
  const BagOfWords a = {{1, 0.5f}, {4, 0.25f}, {7, 0.25f}};
  const BagOfWords b = {{1, 0.125f}, {2, 0.5f}, {7, 0.375f}};
  // |a - b| = 0.375 + 0.5 + 0.25 + 0.125.
  EXPECT_FLOAT_EQ(Similarity(a, b), 1 - 0.5f * 1.25f);
  EXPECT_EQ(Similarity(a, b), Similarity(b, a));
}

TEST(Similarity, GoesFromNothingSharedToEqual) {
  const BagOfWords a = {{0, 0.5f}, {9, 0.5f}}, b = {{1, 1.0f}};
  EXPECT_EQ(Similarity(a, a), 1);
  EXPECT_EQ(Similarity(a, b), 0);
  EXPECT_EQ(Similarity(a, {}), 0);
  EXPECT_EQ(Similarity({}, {}), 0);
}

}  // namespace
}  // namespace deepuav
