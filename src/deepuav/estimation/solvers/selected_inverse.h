#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/estimation/solvers/block_cholesky.h"

namespace deepuav {

/// The diagonal blocks of the inverse of a factorised matrix, by block column of the matrix. Only
/// the inverse's blocks within the factor's pattern are computed (Takahashi et al. 1973), from the
/// last column to the first: about as much work as the factorisation.
template <int kSize>
class SelectedInverse {
 public:
  using Block = Eigen::Matrix<double, kSize, kSize>;

  /// `factor` has been factorised, and must outlive this.
  explicit SelectedInverse(const BlockCholesky<kSize>& factor)
      : factor_(factor),
        pattern_(factor.elimination().factor()),
        blocks_(pattern_.rows.size(), Block::Zero()) {}

  std::vector<Block> DiagonalBlocks() {
    for (int column = pattern_.columns() - 1; column >= 0; --column) InvertColumn(column);
    std::vector<Block> diagonal(static_cast<size_t>(pattern_.columns()));
    for (int column = 0; column < pattern_.columns(); ++column) {
      const int of_matrix = factor_.elimination().order()[column];
      diagonal[static_cast<size_t>(of_matrix)] = At(column, 0);
    }
    return diagonal;
  }

 private:
  Block& At(int column, int slot) {
    return blocks_[static_cast<size_t>(pattern_.begin[column] + slot)];
  }
  int Row(int column, int slot) const { return pattern_.rows[pattern_.begin[column] + slot]; }

  void InvertColumn(int column) {
    const auto panel = factor_.FactorColumn(column);
    const Block inverse =
        panel.template topRows<kSize>().template triangularView<Eigen::Lower>().solve(
            Block::Identity());
    const int blocks = pattern_.blocks(column);
    std::vector<Block> below(static_cast<size_t>(blocks));  // L below the diagonal over that.
    for (int slot = 1; slot < blocks; ++slot)
      below[static_cast<size_t>(slot)] = panel.template middleRows<kSize>(kSize * slot) * inverse;
    for (int first = 1; first < blocks; ++first) MultiplyInverse(column, first, below);
    Block& diagonal = At(column, 0);
    diagonal = inverse.transpose() * inverse;
    for (int slot = 1; slot < blocks; ++slot)
      diagonal.noalias() -= below[static_cast<size_t>(slot)].transpose() * At(column, slot);
  }

  /// Subtracts from the column what the inverse's column of its block `first` takes part in: rows
  /// below a column's diagonal are rows of each of their columns, too.
  void MultiplyInverse(int column, int first, const std::vector<Block>& below) {
    const int other = Row(column, first);
    int at = 0;
    for (int slot = first; slot < pattern_.blocks(column); ++slot) {
      while (Row(other, at) != Row(column, slot)) ++at;
      const Block& inverse = At(other, at);
      At(column, slot).noalias() -= inverse * below[static_cast<size_t>(first)];
      if (slot != first)
        At(column, first).noalias() -= inverse.transpose() * below[static_cast<size_t>(slot)];
    }
  }

  const BlockCholesky<kSize>& factor_;
  const BlockPattern& pattern_;
  std::vector<Block> blocks_;  ///< Of the inverse, as the factor's pattern says.
};

}  // namespace deepuav
