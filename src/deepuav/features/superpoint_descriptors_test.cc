#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "deepuav/features/superpoint_postprocessing.h"

namespace deepuav {
namespace {

struct RandomCells {
  static constexpr int kRows = 6, kColumns = 9, kDimension = 20;

  RandomCells() {
    Random random(6);
    for (int i = 0; i < kRows * kColumns * kDimension; ++i) {
      values.push_back(static_cast<float>(random.Gaussian(1)));
    }
  }
  Eigen::VectorXd At(int row, int column) const {
    row = std::clamp(row, 0, kRows - 1);
    column = std::clamp(column, 0, kColumns - 1);
    return Eigen::Map<const Eigen::VectorXf>(values.data() + (row * kColumns + column) * kDimension,
                                             kDimension)
        .cast<double>();
  }

  std::vector<float> values;
};

void Sample(const RandomCells& cells, const Eigen::Vector2f& px, std::vector<float>* found) {
  std::vector<float> inverse_lengths(RandomCells::kRows * RandomCells::kColumns);
  InverseLengths(cells.values, inverse_lengths);
  found->resize(RandomCells::kDimension);
  SampleDescriptor({cells.values.data(), inverse_lengths.data(), RandomCells::kRows,
                    RandomCells::kColumns, RandomCells::kDimension},
                   px, *found);
}

Eigen::VectorXd Sample(const RandomCells& cells, const Eigen::Vector2f& px) {
  std::vector<float> found;
  Sample(cells, px, &found);
  return Eigen::Map<Eigen::VectorXf>(found.data(), RandomCells::kDimension).cast<double>();
}

TEST(SampleDescriptor, AtACentreIsTheCell) {
  const RandomCells cells;
  for (int row = 0; row < RandomCells::kRows; ++row) {
    for (int column = 0; column < RandomCells::kColumns; ++column) {
      const Eigen::Vector2f centre(8.0f * static_cast<float>(column) + 3.5f,
                                   8.0f * static_cast<float>(row) + 3.5f);
      EXPECT_LT((Sample(cells, centre) - cells.At(row, column).normalized()).norm(), 1e-6);
    }
  }
}

double KeysKernel(double x) {
  const double a = -0.75, d = std::abs(x);
  if (d <= 1) return (a + 2) * d * d * d - (a + 3) * d * d + 1;
  if (d < 2) return a * d * d * d - 5 * a * d * d + 8 * a * d - 4 * a;
  return 0;
}

TEST(SampleDescriptor, IsTheCubicConvolution) {
  const RandomCells cells;
  Random random(7);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2f px(static_cast<float>(random.Uniform(-0.5, 71.5)),
                             static_cast<float>(random.Uniform(-0.5, 47.5)));
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(RandomCells::kDimension);
    for (int row = -3; row < RandomCells::kRows + 3; ++row) {
      for (int column = -3; column < RandomCells::kColumns + 3; ++column) {
        expected += KeysKernel((px.x() - 3.5) / 8 - column) * KeysKernel((px.y() - 3.5) / 8 - row) *
                    cells.At(row, column).normalized();
      }
    }
    EXPECT_LT((Sample(cells, px) - expected.normalized()).norm(), 1e-5);
  }
}

TEST(SampleDescriptor, ZeroStaysZero) {
  RandomCells cells;
  std::fill(cells.values.begin(), cells.values.end(), 0.0f);
  EXPECT_EQ(Sample(cells, {20, 20}).norm(), 0);
}

TEST(SampleDescriptor, ValuesThatAreNotFiniteAreRefused) {
  RandomCells cells;
  cells.values[0] = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> found;
  EXPECT_THROW(Sample(cells, {4, 4}, &found), Error);
  cells.values[0] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(Sample(cells, {4, 4}, &found), Error);
}

TEST(InverseLengths, BringEachDescriptorToLengthOne) {
  for (const int dimension : {3, 16, 256}) {
    Random random(8);
    std::vector<float> values(static_cast<size_t>(5 * dimension)), inverse(5);
    for (float& value : values) value = static_cast<float>(random.Gaussian(3));
    std::fill_n(values.begin() + dimension, dimension, 0.0f);
    InverseLengths(values, inverse);
    for (int cell = 0; cell < 5; ++cell) {
      const double length = Eigen::Map<Eigen::VectorXf>(values.data() + cell * dimension, dimension)
                                .cast<double>()
                                .norm();
      EXPECT_NEAR(inverse[static_cast<size_t>(cell)] * length, cell == 1 ? 0 : 1, 1e-6);
    }
  }
}

}  // namespace
}  // namespace deepuav
