#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "deepuav/base/sha256.h"
#include "deepuav/place/vocabulary.h"
#include "support/fuzzing.h"

namespace deepuav {
namespace {

constexpr size_t kDigestBytes = 64;

/// A root with a word and a node of two words.
std::string SmallVocabulary() {
  VocabularyTree tree;
  tree.dimension = 3;
  tree.child_counts = {2, 0, 2, 0, 0};
  tree.centres = {100, 0, 0, 0, 9, 9, 0, 5, 0, 0, 0, 127};
  tree.idf = {1.0f, 2.0f, 0.0f};
  return Vocabulary(tree).Bytes();
}

Descriptors ImageOf(int dimension) {
  Descriptors image(dimension);
  image.Append(std::vector<float>(static_cast<size_t>(dimension), 0.5f));
  return image;
}

/// The digest is made anew, else it would refuse all.
TEST(VocabularyFuzzTest, TreesThatContradictThemselves) {
  const std::string whole = SmallVocabulary();
  Fuzz({whole.substr(0, whole.size() - kDigestBytes)}, 20000, [](const std::string& input) {
    const Vocabulary vocabulary = Vocabulary::FromBytes(input + Sha256(input), "words.bin");
    for (const WordWeight& word : vocabulary.Words(ImageOf(vocabulary.dimension()))) {
      EXPECT_LT(word.word, vocabulary.word_count());
      EXPECT_TRUE(std::isfinite(word.weight));
    }
  });
}

}  // namespace
}  // namespace deepuav
