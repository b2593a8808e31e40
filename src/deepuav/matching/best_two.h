#pragma once

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

  /// Lowe's test on distances (2004); the squared distance of unit vectors is 2 - 2 cos.
  bool PassesRatio(double ratio) const { return (1 - first) <= ratio * ratio * (1 - second); }
};

}  // namespace deepuav
