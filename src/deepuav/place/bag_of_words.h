#pragma once

#include <vector>

namespace deepuav {

struct WordWeight {
  int word = 0;
  float weight = 0;

  bool operator==(const WordWeight&) const = default;
};

/// What an image shows, as L1-normalised tf-idf weights by rising word, all above 0. Empty for an
/// image without a word that tells anything.
using BagOfWords = std::vector<WordWeight>;

/// 1 - |a - b|_1 / 2, in 0 (no word shared) to 1 (equal): the L1 score of Galvez-Lopez and Tardos,
/// "Bags of Binary Words for Fast Place Recognition in Image Sequences", T-RO 2012, equation 2.
float Similarity(const BagOfWords& a, const BagOfWords& b);

}  // namespace deepuav
