#pragma once

#include <algorithm>

namespace deepuav {

/// The best candidate by cosine similarity, and how good the second best is.
struct BestTwo {
  int index = -1;
  float first = -2, second = -2;  // below any cosine

  void Offer(int candidate, float similarity) {
    if (similarity > first) {
      second = first;
      first = similarity;
      index = candidate;
    } else if (similarity > second) {
      second = similarity;
    }
  }

  /// Lowe's test on distances (2004); the squared distance of unit vectors is 2 - 2 cos. Rounded
  /// ones may be a little longer than 1. Two that are equally near pass where the ratio is 1, which
  /// is no test, alone.
  bool PassesRatio(double ratio) const {
    const float to_first = std::max(1 - first, 0.0F), to_second = std::max(1 - second, 0.0F);
    return ratio >= 1 || (to_first < to_second && to_first <= ratio * ratio * to_second);
  }
};

}  // namespace deepuav
