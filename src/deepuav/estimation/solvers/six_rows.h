#pragma once

#include <cstring>

namespace deepuav {

/// Six numbers, a column of a pose's block, as vector registers hold them: compilers do not find
/// four and two by themselves.
class SixRows {
 public:
  static SixRows Load(const double* from) {
    SixRows rows;
    std::memcpy(&rows.head_, from, sizeof(rows.head_));
    std::memcpy(&rows.tail_, from + kHead, sizeof(rows.tail_));
    return rows;
  }
  void Store(double* to) const {
    std::memcpy(to, &head_, sizeof(head_));
    std::memcpy(to + kHead, &tail_, sizeof(tail_));
  }
  void SubtractProduct(const SixRows& other, double factor) {
    head_ -= other.head_ * factor;
    tail_ -= other.tail_ * factor;
  }

 private:
  static constexpr int kHead = 4;
  typedef double Head __attribute__((vector_size(kHead * sizeof(double))));
  typedef double Tail __attribute__((vector_size(2 * sizeof(double))));

  Head head_;
  Tail tail_;
};

/// out -= a b, of 6 x kInner and kInner x 6. `a_stride` and `out_stride`: from a column to the
/// next; element (k, c) of b is b[k * b_row_stride + c * b_column_stride].
template <int kInner>
inline void SubtractSixBySix(const double* a, int a_stride, const double* b, int b_row_stride,
                             int b_column_stride, double* out, int out_stride) {
  SixRows columns[kInner];
  for (int k = 0; k < kInner; ++k) columns[k] = SixRows::Load(a + k * a_stride);
  for (int c = 0; c < 6; ++c) {
    SixRows sum = SixRows::Load(out + c * out_stride);
    for (int k = 0; k < kInner; ++k)
      sum.SubtractProduct(columns[k], b[k * b_row_stride + c * b_column_stride]);
    sum.Store(out + c * out_stride);
  }
}

}  // namespace deepuav
