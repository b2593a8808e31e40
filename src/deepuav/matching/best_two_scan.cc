#include "deepuav/matching/best_two_scan.h"

#include <cstdint>
#include <cstring>

namespace deepuav {
namespace {

constexpr size_t kLanes = 8;
using Floats = float __attribute__((vector_size(kLanes * sizeof(float))));
using Indices = int32_t __attribute__((vector_size(kLanes * sizeof(int32_t))));

template <typename Vector, typename Value>
Vector Load(const Value* values) {
  Vector vector;
  std::memcpy(&vector, values, sizeof vector);
  return vector;
}

template <typename Vector, typename Value>
void Store(const Vector& vector, Value* values) {
  std::memcpy(values, &vector, sizeof vector);
}

/// BestTwo, one in each lane.
struct BestTwoLanes {
  Floats first, second;
  Indices index;

  void Offer(const Indices& candidate, const Floats& similarity) {
    const Indices better = similarity > first;
    const Floats next = similarity > second ? similarity : second;
    second = better ? first : next;
    first = better ? similarity : first;
    index = better ? candidate : index;
  }
};

/// BestTwo of many columns, each member in an array of its own.
struct Columns {
  std::vector<float> first, second;
  std::vector<int32_t> index;

  explicit Columns(size_t count)
      : first(count, BestTwo().first), second(count, BestTwo().second), index(count, -1) {}

  void OfferRow(size_t column, const Indices& row, const Floats& similarity) {
    BestTwoLanes lanes{Load<Floats>(&first[column]), Load<Floats>(&second[column]),
                       Load<Indices>(&index[column])};
    lanes.Offer(row, similarity);
    Store(lanes.first, &first[column]);
    Store(lanes.second, &second[column]);
    Store(lanes.index, &index[column]);
  }
};

/// The best two of all lanes: of equally good ones the one with the smallest index.
BestTwo Merge(const BestTwoLanes& lanes) {
  BestTwo best;
  for (size_t k = 0; k < kLanes; ++k) {
    const bool earlier = lanes.first[k] == best.first && lanes.index[k] < best.index;
    best.Offer(lanes.index[k], lanes.first[k]);
    if (earlier) best.index = lanes.index[k];
    if (lanes.second[k] > best.second) best.second = lanes.second[k];
  }
  return best;
}

}  // namespace

BestTwoOfMatrix FindBestTwo(std::span<const float> matrix, size_t rows, size_t columns) {
  BestTwoOfMatrix result{std::vector<BestTwo>(rows), std::vector<BestTwo>(columns)};
  const size_t whole = columns / kLanes * kLanes;
  Columns of_columns(whole);
  const Indices first_lanes = {0, 1, 2, 3, 4, 5, 6, 7};
  for (size_t i = 0; i < rows; ++i) {
    const float* row = matrix.data() + i * columns;
    const Indices row_index = Indices{} + static_cast<int32_t>(i);
    Indices column_index = first_lanes;
    const Floats nothing = Floats{} + BestTwo().first;
    BestTwoLanes lanes{nothing, nothing, Indices{} - 1};
    for (size_t j = 0; j < whole; j += kLanes) {
      const Floats similarity = Load<Floats>(row + j);
      lanes.Offer(column_index, similarity);
      of_columns.OfferRow(j, row_index, similarity);
      column_index += static_cast<int32_t>(kLanes);
    }
    BestTwo& best = result.of_rows[i] = Merge(lanes);
    for (size_t j = whole; j < columns; ++j) {
      best.Offer(static_cast<int>(j), row[j]);
      result.of_columns[j].Offer(static_cast<int>(i), row[j]);
    }
  }
  for (size_t j = 0; j < whole; ++j)
    result.of_columns[j] = {of_columns.index[j], of_columns.first[j], of_columns.second[j]};
  return result;
}

}  // namespace deepuav
