#include "deepuav/estimation/solvers/block_cholesky.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

namespace deepuav {

BlockPattern BlockPattern::OfPairs(int columns, std::vector<std::pair<int, int>> pairs) {
  for (int i = 0; i < columns; ++i) pairs.emplace_back(i, i);
  std::sort(pairs.begin(), pairs.end(), [](const auto& left, const auto& right) {
    return std::pair(left.second, left.first) < std::pair(right.second, right.first);
  });
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  BlockPattern pattern;
  pattern.begin.assign(columns + 1, 0);
  pattern.rows.reserve(pairs.size());
  for (const auto& [row, column] : pairs) {
    pattern.rows.push_back(row);
    ++pattern.begin[column + 1];
  }
  for (int i = 0; i < columns; ++i) pattern.begin[i + 1] += pattern.begin[i];
  return pattern;
}

BlockElimination::BlockElimination(const BlockPattern& matrix) {
  FindOrder(matrix);
  FindSources(matrix);
  FindFactor();
  FindPlaces();
}

void BlockElimination::FindOrder(const BlockPattern& matrix) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(matrix.rows.size());
  for (int column = 0; column < matrix.columns(); ++column) {
    for (int i = matrix.begin[column]; i < matrix.begin[column + 1]; ++i) {
      entries.emplace_back(matrix.rows[i], column, 1);
    }
  }
  Eigen::SparseMatrix<double> blocks(matrix.columns(), matrix.columns());
  blocks.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseMatrix<double> symmetric = blocks.selfadjointView<Eigen::Lower>();
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> old_from_new;
  if (matrix.columns() > 0) Eigen::AMDOrdering<int>()(symmetric, old_from_new);
  order_.assign(old_from_new.indices().data(),
                old_from_new.indices().data() + old_from_new.indices().size());
}

void BlockElimination::FindSources(const BlockPattern& matrix) {
  const int columns = matrix.columns();
  std::vector<int> place_of(columns);
  for (int i = 0; i < columns; ++i) place_of[order_[i]] = i;
  source_begin_.assign(columns + 1, 0);
  const auto visit = [&](const auto& take) {
    for (int column = 0; column < columns; ++column) {
      for (int slot = 0; slot < matrix.blocks(column); ++slot) {
        const int row = place_of[matrix.rows[matrix.begin[column] + slot]];
        const bool transposed = row < place_of[column];
        take(transposed ? row : place_of[column],
             Source{column, slot, transposed, transposed ? place_of[column] : row});
      }
    }
  };
  visit([&](int target, const Source&) { ++source_begin_[target + 1]; });
  for (int i = 0; i < columns; ++i) source_begin_[i + 1] += source_begin_[i];
  sources_.resize(matrix.rows.size());
  std::vector<int> next(source_begin_.begin(), source_begin_.end() - 1);
  visit([&](int target, const Source& source) { sources_[next[target]++] = source; });
}

void BlockElimination::FindFactor() {
  const int columns = static_cast<int>(order_.size());
  std::vector<int> seen_by(columns, -1);
  std::vector<std::vector<int>> children(columns);  // Of the elimination tree.
  for (int column = 0; column < columns; ++column) {
    const size_t first = factor_.rows.size();
    const auto add = [&](int row) {
      if (seen_by[row] == column) return;
      seen_by[row] = column;
      factor_.rows.push_back(row);
    };
    add(column);
    for (int i = source_begin_[column]; i < source_begin_[column + 1]; ++i) add(sources_[i].row);
    for (const int child : children[column]) {
      for (int i = factor_.begin[child] + 1; i < factor_.begin[child + 1]; ++i) {
        add(factor_.rows[i]);
      }
    }
    std::sort(factor_.rows.begin() + static_cast<std::ptrdiff_t>(first), factor_.rows.end());
    factor_.begin.push_back(static_cast<int>(factor_.rows.size()));
    if (factor_.blocks(column) > 1) children[factor_.rows[first + 1]].push_back(column);
  }
}

void BlockElimination::FindPlaces() {
  const int columns = factor_.columns();
  place_begin_.assign(columns + 1, 0);
  for (int column = 0; column < columns; ++column) {
    for (int slot = 1; slot < factor_.blocks(column); ++slot) {
      ++place_begin_[factor_.rows[factor_.begin[column] + slot] + 1];
    }
  }
  for (int i = 0; i < columns; ++i) place_begin_[i + 1] += place_begin_[i];
  places_.resize(place_begin_.back());
  std::vector<int> next(place_begin_.begin(), place_begin_.end() - 1);
  for (int column = 0; column < columns; ++column) {
    for (int slot = 1; slot < factor_.blocks(column); ++slot) {
      places_[next[factor_.rows[factor_.begin[column] + slot]]++] = {column, slot};
    }
  }
}

int64_t BlockElimination::products() const {
  int64_t count = 0;
  for (int column = 0; column < factor_.columns(); ++column) {
    const int64_t below = factor_.blocks(column) - 1;
    count += below * (below + 1) / 2;
  }
  return count;
}

}  // namespace deepuav
