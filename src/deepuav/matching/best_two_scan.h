#pragma once

#include <span>
#include <vector>

#include "deepuav/matching/best_two.h"

namespace deepuav {

/// The best two of each row and of each column of a matrix.
struct BestTwoOfMatrix {
  std::vector<BestTwo> of_rows, of_columns;
};

/// What offering every value to its row and its column would give, several columns at a time.
/// `matrix` is row-major without NaN; its size is `rows` times `columns`.
BestTwoOfMatrix FindBestTwo(std::span<const float> matrix, size_t rows, size_t columns);

}  // namespace deepuav
