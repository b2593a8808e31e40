#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <utility>
#include <vector>

#include "deepuav/estimation/solvers/block_cholesky.h"

namespace deepuav {

/// The values of a matrix whose pattern is known, as BlockPattern says: for BlockCholesky.
template <int kSize>
class BlockValues {
 public:
  /// All 0.
  explicit BlockValues(BlockPattern pattern)
      : pattern_(std::move(pattern)),
        values_(static_cast<size_t>(kSize * kSize) * pattern_.rows.size(), 0.0) {}

  const BlockPattern& pattern() const { return pattern_; }
  const double* data() const { return values_.data(); }
  void Clear() { std::fill(values_.begin(), values_.end(), 0.0); }

  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, kSize>> Column(int column) {
    return {values_.data() + static_cast<size_t>(kSize * kSize) * pattern_.begin[column],
            kSize * pattern_.blocks(column), kSize};
  }
  /// A block of the pattern, row >= column.
  auto At(int row, int column) {
    const auto begin = pattern_.rows.begin() + pattern_.begin[column];
    const auto end = pattern_.rows.begin() + pattern_.begin[column + 1];
    const auto slot = std::lower_bound(begin, end, row) - begin;
    return Column(column).template middleRows<kSize>(kSize * slot);
  }

 private:
  const BlockPattern pattern_;
  std::vector<double> values_;
};

}  // namespace deepuav
