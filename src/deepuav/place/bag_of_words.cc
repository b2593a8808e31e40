#include "deepuav/place/bag_of_words.h"

#include <algorithm>

namespace deepuav {

float Similarity(const BagOfWords& a, const BagOfWords& b) {
  // As both sum to 1, what the smaller weights sum to is 1 - |a - b|_1 / 2.
  float shared = 0;
  auto in_a = a.begin();
  auto in_b = b.begin();
  while (in_a != a.end() && in_b != b.end()) {
    if (in_a->word < in_b->word) {
      ++in_a;
    } else if (in_b->word < in_a->word) {
      ++in_b;
    } else {
      shared += std::min(in_a++->weight, in_b++->weight);
    }
  }
  return shared;
}

}  // namespace deepuav
