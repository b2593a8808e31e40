#include "deepuav/features/descriptors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

std::vector<float> RandomUnitRow(int dimension, Random* random) {
  std::vector<float> row(static_cast<size_t>(dimension));
  float squares = 0;
  for (float& value : row) {
    value = static_cast<float>(random->Gaussian(1));
    squares += value * value;
  }
  for (float& value : row) value /= std::sqrt(squares);
  return row;
}

TEST(Descriptors, SimilarityIsTheCosine) {
  for (const int dimension : {64, 100, 256}) {
    Random random(1);
    Descriptors a(dimension), b(dimension);
    std::vector<std::vector<float>> a_rows, b_rows;
    for (int i = 0; i < 40; ++i) {
      a_rows.push_back(RandomUnitRow(dimension, &random));
      // Near and far pairs.
      b_rows.push_back(RandomUnitRow(dimension, &random));
      for (size_t k = 0; k < b_rows.back().size(); ++k)
        b_rows.back()[k] += 0.05f * static_cast<float>(i) * a_rows.back()[k];
      const float norm = std::sqrt(std::inner_product(b_rows.back().begin(), b_rows.back().end(),
                                                      b_rows.back().begin(), 0.0f));
      for (float& value : b_rows.back()) value /= norm;
      a.Append(a_rows.back());
      b.Append(b_rows.back());
    }
    std::vector<float> matrix(static_cast<size_t>(a.size() * b.size()));
    a.SimilarityMatrix(b, matrix);
    for (int i = 0; i < a.size(); ++i) {
      for (int j = 0; j < b.size(); ++j) {
        const auto& u = a_rows[static_cast<size_t>(i)];
        const auto& v = b_rows[static_cast<size_t>(j)];
        const float cosine = std::inner_product(u.begin(), u.end(), v.begin(), 0.0f);
        EXPECT_NEAR(a.Similarity(i, b, j), cosine, 0.005f);
        EXPECT_EQ(a.Similarity(i, b, j), matrix[static_cast<size_t>(i * b.size() + j)]);
      }
    }
  }
}

TEST(Descriptors, ReadGivesBackTheRow) {
  Random random(2);
  Descriptors descriptors(256);
  const auto row = RandomUnitRow(256, &random);
  descriptors.Append(row);
  std::vector<float> read(256);
  descriptors.Read(0, read);
  const float largest = std::abs(*std::max_element(
      row.begin(), row.end(), [](float a, float b) { return std::abs(a) < std::abs(b); }));
  for (size_t k = 0; k < row.size(); ++k) EXPECT_NEAR(read[k], row[k], 0.5001f * largest / 127);
}

TEST(Descriptors, AppendFromCopiesExactly) {
  Random random(3);
  Descriptors source(64), copy(64);
  for (int i = 0; i < 3; ++i) source.Append(RandomUnitRow(64, &random));
  copy.AppendFrom(source, 2);
  copy.AppendFrom(source, 0);
  copy.AppendFrom(copy, 0);  // from itself, though it may grow meanwhile
  std::vector<float> expected(64), read(64);
  for (const auto& [from, to] : {std::pair{2, 0}, {0, 1}, {2, 2}}) {
    source.Read(from, expected);
    copy.Read(to, read);
    EXPECT_EQ(read, expected);
  }
}

TEST(Descriptors, ZeroRowIsLikeNothing) {
  Random random(4);
  Descriptors descriptors(64);
  descriptors.Append(std::vector<float>(64, 0.0f));
  descriptors.Append(RandomUnitRow(64, &random));
  EXPECT_EQ(descriptors.Similarity(0, descriptors, 1), 0);
  EXPECT_EQ(descriptors.Similarity(0, descriptors, 0), 0);
}

TEST(Descriptors, BadRowsAreRefused) {
  Descriptors descriptors(4);
  EXPECT_THROW(descriptors.Append(std::vector<float>(3, 0.5f)), Error);
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  EXPECT_THROW(descriptors.Append(std::vector<float>{0.5f, nan, 0, 0}), Error);
  EXPECT_THROW(descriptors.Append(std::vector<float>{0.5f, 0, -infinity, 0}), Error);
  EXPECT_EQ(descriptors.size(), 0);
}

TEST(Descriptors, OtherDimensionsAndRoomAreRefused) {
  Descriptors a(4), b(8);
  a.Append(std::vector<float>(4, 0.5f));
  b.Append(std::vector<float>(8, 0.35f));
  std::vector<float> room(2), read(5);
  EXPECT_THROW(a.Similarity(0, b, 0), Error);
  EXPECT_THROW(a.AppendFrom(b, 0), Error);
  EXPECT_THROW(a.SimilarityMatrix(a, room), Error);
  EXPECT_THROW(a.Read(0, read), Error);
}

TEST(Descriptors, AreRestoredFromWhatIsStored) {
  Descriptors original(4);
  original.Append(std::vector<float>{0.5f, -0.5f, 0.5f, -0.5f});
  original.Append(std::vector<float>{0.1f, 0.2f, -0.3f, 0.9f});
  const auto values = original.stored_values();
  const auto scales = original.scales();
  const Descriptors restored =
      Descriptors::FromStored(4, {values.begin(), values.end()}, {scales.begin(), scales.end()});
  ASSERT_EQ(restored.size(), 2);
  std::vector<float> expected(4), found(4);
  for (int i = 0; i < 2; ++i) {
    original.Read(i, expected);
    restored.Read(i, found);
    EXPECT_EQ(found, expected);
  }
}

TEST(Descriptors, StoredValuesThatCannotBeAreRefused) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(Descriptors::FromStored(0, {}, {}), Error);
  EXPECT_THROW(Descriptors::FromStored(2, {1, 2, 3}, {1}), Error);
  EXPECT_THROW(Descriptors::FromStored(2, {1, 2}, {1, 1}), Error);
  EXPECT_THROW(Descriptors::FromStored(2, {1, -128}, {1}), Error);
  EXPECT_THROW(Descriptors::FromStored(2, {1, 2}, {nan}), Error);
  EXPECT_THROW(Descriptors::FromStored(2, {1, 2}, {-1}), Error);
}

}  // namespace
}  // namespace deepuav
