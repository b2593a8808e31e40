#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "deepuav/base/parallel.h"
#include "deepuav/estimation/solvers/six_rows.h"

namespace deepuav {

/// The lower triangle of a sparse symmetric matrix of square blocks: block column i holds the
/// blocks of the rows rows[begin[i]] .. rows[begin[i + 1] - 1], ascending, the diagonal one first.
/// The values of a block column are one dense matrix, column by column, its blocks one below the
/// other; block columns follow one another.
struct BlockPattern {
  std::vector<int> rows, begin{0};

  int columns() const { return static_cast<int>(begin.size()) - 1; }
  int blocks(int column) const { return begin[column + 1] - begin[column]; }
  /// The pattern of the pairs (row, column), row >= column, and of the diagonal.
  static BlockPattern OfPairs(int columns, std::vector<std::pair<int, int>> pairs);
};

/// The order of elimination that keeps the factor of a block matrix sparse (approximate minimum
/// degree, Amestoy et al. 1996), and the factor's pattern in that order.
class BlockElimination {
 public:
  explicit BlockElimination(const BlockPattern& matrix);

  /// A block of the matrix and where it goes in the factor's column at hand.
  struct Source {
    int column, slot;  ///< In the matrix.
    bool transposed;
    int row;  ///< In the factor.
  };
  /// A block of the factor, by its column and place there.
  struct Place {
    int column, slot;
  };

  const BlockPattern& factor() const { return factor_; }
  /// By column of the factor: the column of the matrix.
  const std::vector<int>& order() const { return order_; }
  /// The blocks of the matrix in a column of the factor: [source_begin()[i], source_begin()[i +
  /// 1]).
  const std::vector<Source>& sources() const { return sources_; }
  const std::vector<int>& source_begin() const { return source_begin_; }
  /// The blocks of the factor left of the diagonal in a row.
  const std::vector<Place>& places() const { return places_; }
  const std::vector<int>& place_begin() const { return place_begin_; }
  /// The products of two blocks that a factorisation takes.
  int64_t products() const;

 private:
  void FindOrder(const BlockPattern& matrix);
  void FindSources(const BlockPattern& matrix);
  void FindFactor();
  void FindPlaces();

  BlockPattern factor_;
  std::vector<int> order_;
  std::vector<Source> sources_;
  std::vector<int> source_begin_;
  std::vector<Place> places_;
  std::vector<int> place_begin_;
};

/// The Cholesky factorisation of a sparse positive definite matrix of kSize x kSize blocks. Several
/// times faster than a factorisation by scalars, as it works on dense columns of blocks. The result
/// depends only on the input (fixed order, whatever the number of threads).
template <int kSize>
class BlockCholesky {
 public:
  explicit BlockCholesky(const BlockPattern& matrix) : matrix_(matrix), elimination_(matrix) {
    const BlockPattern& factor = elimination_.factor();
    values_.resize(kBlockValues * factor.rows.size());
    slot_of_row_.resize(factor.columns());
  }

  using Panel = Eigen::Matrix<double, Eigen::Dynamic, kSize>;

  const BlockElimination& elimination() const { return elimination_; }

  /// A block column of the factor, as of the last Factorise.
  Eigen::Map<const Panel> FactorColumn(int column) const {
    const BlockPattern& factor = elimination_.factor();
    return {values_.data() + static_cast<size_t>(kBlockValues) * factor.begin[column],
            kSize * factor.blocks(column), kSize};
  }

  /// `values` as BlockPattern says; of the diagonal blocks only the lower triangles are read. Up to
  /// `threads` work on large columns. False where the matrix is not positive definite.
  bool Factorise(const double* values, int threads = 1) {
    for (int column = 0; column < elimination_.factor().columns(); ++column) {
      Assemble(values, column);
      SubtractEarlierColumns(column, threads);
      if (!FactoriseColumn(column)) return false;
    }
    return true;
  }

  /// Replaces the right sides by the solutions; kSize rows a block column of the matrix.
  template <int kColumns>
  void SolveInPlace(Eigen::Matrix<double, Eigen::Dynamic, kColumns>* right) const {
    const BlockPattern& factor = elimination_.factor();
    Eigen::Matrix<double, Eigen::Dynamic, kColumns> x(right->rows(), right->cols());
    for (int i = 0; i < factor.columns(); ++i) {
      Rows(&x, i) = Rows(right, elimination_.order()[i]);
    }
    for (int i = 0; i < factor.columns(); ++i) {
      const auto panel = FactorColumn(i);
      auto here = Rows(&x, i);
      panel.template topRows<kSize>().template triangularView<Eigen::Lower>().solveInPlace(here);
      for (int slot = 1; slot < factor.blocks(i); ++slot) {
        Rows(&x, factor.rows[factor.begin[i] + slot]).noalias() -=
            panel.template middleRows<kSize>(kSize * slot).lazyProduct(here);
      }
    }
    for (int i = factor.columns() - 1; i >= 0; --i) {
      const auto panel = FactorColumn(i);
      auto here = Rows(&x, i);
      for (int slot = 1; slot < factor.blocks(i); ++slot) {
        here.noalias() -= panel.template middleRows<kSize>(kSize * slot)
                              .transpose()
                              .lazyProduct(Rows(&x, factor.rows[factor.begin[i] + slot]));
      }
      const auto diagonal = panel.template topRows<kSize>();
      diagonal.template triangularView<Eigen::Lower>().transpose().solveInPlace(here);
    }
    for (int i = 0; i < factor.columns(); ++i) {
      Rows(right, elimination_.order()[i]) = Rows(&x, i);
    }
  }

 private:
  static constexpr int kBlockValues = kSize * kSize;
  using Block = Eigen::Matrix<double, kSize, kSize>;

  template <typename Matrix>
  static auto Rows(Matrix* matrix, int block) {
    return matrix->template middleRows<kSize>(kSize * block);
  }

  Eigen::Map<Panel> FactorColumn(int column) {
    const BlockPattern& factor = elimination_.factor();
    return {values_.data() + static_cast<size_t>(kBlockValues) * factor.begin[column],
            kSize * factor.blocks(column), kSize};
  }

  void Assemble(const double* values, int column) {
    const BlockPattern& factor = elimination_.factor();
    for (int slot = 0; slot < factor.blocks(column); ++slot) {
      slot_of_row_[factor.rows[factor.begin[column] + slot]] = slot;
    }
    auto panel = FactorColumn(column);
    panel.setZero();
    for (int i = elimination_.source_begin()[column]; i < elimination_.source_begin()[column + 1];
         ++i) {
      const BlockElimination::Source& source = elimination_.sources()[i];
      const Eigen::Map<const Panel> from(
          values + static_cast<size_t>(kBlockValues) * matrix_.begin[source.column],
          kSize * matrix_.blocks(source.column), kSize);
      const auto block = from.template middleRows<kSize>(kSize * source.slot);
      auto to = panel.template middleRows<kSize>(kSize * slot_of_row_[source.row]);
      if (source.transposed) {
        to = block.transpose();
      } else {
        to = block;
      }
    }
  }

  /// Each thread takes rows of its own: what is subtracted from a block comes in the same order.
  void SubtractEarlierColumns(int column, int threads) {
    constexpr int kPartsOfAThread = 4;
    constexpr int64_t kWorthThreads = 20'000;  // Products of blocks: some 0.3 ms.
    const int blocks = elimination_.factor().blocks(column);
    if (threads <= 1 || ProductsInto(column) < kWorthThreads) {
      SubtractEarlierColumns(column, 0, blocks);
      return;
    }
    const int parts = std::min(blocks, kPartsOfAThread * threads);
    ForEachInParallel(parts, threads, [&](int part) {
      const PartOf slots(blocks, part, parts);
      SubtractEarlierColumns(column, slots.first, slots.last);
    });
  }

  int64_t ProductsInto(int column) const {
    int64_t products = 0;
    for (int i = elimination_.place_begin()[column]; i < elimination_.place_begin()[column + 1];
         ++i) {
      const BlockElimination::Place& place = elimination_.places()[i];
      products += elimination_.factor().blocks(place.column) - place.slot;
    }
    return products;
  }

  /// From the blocks `first` to `last` - 1 of the column.
  void SubtractEarlierColumns(int column, int first, int last) {
    const BlockPattern& factor = elimination_.factor();
    auto panel = FactorColumn(column);
    for (int i = elimination_.place_begin()[column]; i < elimination_.place_begin()[column + 1];
         ++i) {
      const BlockElimination::Place& place = elimination_.places()[i];
      const auto earlier = FactorColumn(place.column);
      const int blocks = factor.blocks(place.column);
      const Block block = earlier.template middleRows<kSize>(kSize * place.slot);
      const int* rows = &factor.rows[factor.begin[place.column]];
      // Rows ascend in both columns.
      const int* begin = std::partition_point(rows + place.slot, rows + blocks,
                                              [&](int row) { return slot_of_row_[row] < first; });
      for (int slot = static_cast<int>(begin - rows); slot < blocks; ++slot) {
        if (slot_of_row_[rows[slot]] >= last) break;
        const int to = kSize * slot_of_row_[rows[slot]];
        if constexpr (kSize == 6) {
          SubtractSixBySix<6>(earlier.data() + kSize * slot, static_cast<int>(earlier.rows()),
                              block.data(), kSize, 1, panel.data() + to,
                              static_cast<int>(panel.rows()));
        } else {
          panel.template middleRows<kSize>(to).noalias() -=
              earlier.template middleRows<kSize>(kSize * slot).lazyProduct(block.transpose());
        }
      }
    }
  }

  bool FactoriseColumn(int column) {
    auto panel = FactorColumn(column);
    const Eigen::LLT<Block> diagonal(Block(panel.template topRows<kSize>()));
    // LLT lets what is not a number pass, and leaves pivots that it refuses as they were.
    if (diagonal.info() != Eigen::Success) return false;
    if (!(diagonal.matrixLLT().diagonal().array() > 0).all()) return false;
    panel.template topRows<kSize>() = diagonal.matrixL();
    auto below = panel.bottomRows(panel.rows() - kSize);
    diagonal.matrixU().template solveInPlace<Eigen::OnTheRight>(below);
    return true;
  }

  BlockPattern matrix_;
  BlockElimination elimination_;
  std::vector<double> values_;    ///< Of the factor, as BlockPattern says.
  std::vector<int> slot_of_row_;  ///< Of the column at hand.
};

}  // namespace deepuav
