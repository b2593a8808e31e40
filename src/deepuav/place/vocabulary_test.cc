#include "deepuav/place/vocabulary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "deepuav/base/sha256.h"

namespace deepuav {
namespace {

using testing::ElementsAre;

/// Root with a word (along x) and a node (towards y and z) of two words (y; z).
VocabularyTree SmallTree() {
  VocabularyTree tree;
  tree.dimension = 3;
  tree.child_counts = {2, 0, 2, 0, 0};
  tree.centres = {100, 0, 0,  //
                  0,   9, 9,  //
                  0,   5, 0,  //
                  0,   0, 127};
  tree.idf = {1.0f, 2.0f, 0.0f};
  return tree;
}

Descriptors Rows(const std::vector<std::vector<float>>& rows) {
  Descriptors descriptors(static_cast<int>(rows.front().size()));
  for (const auto& row : rows) descriptors.Append(row);
  return descriptors;
}

const Descriptors& ImageOfAllWords() {
  // Words 0, 0, 1, 2.
  static const Descriptors image =
      Rows({{1, 0, 0}, {0.8f, 0.6f, 0}, {0.1f, 0.9f, 0.4f}, {0, 0.1f, 0.9f}});
  return image;
}

TEST(Vocabulary, DescendsToTheMostSimilarWord) {
  const Vocabulary vocabulary(SmallTree());
  EXPECT_EQ(vocabulary.word_count(), 3);
  EXPECT_EQ(vocabulary.node_count(), 5);
  EXPECT_EQ(vocabulary.depth(), 2);
  EXPECT_THAT(vocabulary.WordIndices(ImageOfAllWords()), ElementsAre(0, 0, 1, 2));
}

TEST(Vocabulary, OnlyTheDirectionOfACentreCounts) {
  VocabularyTree tree = SmallTree();
  tree.centres[0] = 3;
  EXPECT_THAT(Vocabulary(tree).WordIndices(ImageOfAllWords()), ElementsAre(0, 0, 1, 2));
}

TEST(Vocabulary, WeighsByTfIdfAndNormalises) {
  const Vocabulary vocabulary(SmallTree());
  // 2 x 1.0, 1 x 2.0, and a word that tells nothing.
  EXPECT_THAT(vocabulary.Words(ImageOfAllWords()),
              ElementsAre(WordWeight{0, 0.5f}, WordWeight{1, 0.5f}));
  EXPECT_TRUE(vocabulary.Words(Descriptors(3)).empty());
  EXPECT_TRUE(vocabulary.Words(Rows({{0, 0, 1}})).empty());
}

TEST(Vocabulary, DirectIndexNamesANodeAboveEachWord) {
  const Vocabulary vocabulary(SmallTree());
  EXPECT_THAT(vocabulary.Assign(ImageOfAllWords(), 0).nodes, ElementsAre(1, 1, 3, 4));
  EXPECT_THAT(vocabulary.Assign(ImageOfAllWords(), 1).nodes, ElementsAre(1, 1, 2, 2));
  EXPECT_THAT(vocabulary.Assign(ImageOfAllWords(), 2).nodes, ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(vocabulary.Assign(ImageOfAllWords(), 9).nodes, ElementsAre(0, 0, 0, 0));
  EXPECT_EQ(vocabulary.Assign(ImageOfAllWords(), 1).words, vocabulary.Words(ImageOfAllWords()));
}

TEST(Vocabulary, SimilarityToAWordIsTheCosine) {
  const Vocabulary vocabulary(SmallTree());
  EXPECT_NEAR(vocabulary.SimilarityToWord(ImageOfAllWords(), 1, 0), 0.8f, 0.005f);
  EXPECT_NEAR(vocabulary.SimilarityToWord(ImageOfAllWords(), 1, 1), 0.6f, 0.005f);
}

std::vector<float> RandomDirection(int dimension, Random* random) {
  std::vector<float> row(static_cast<size_t>(dimension));
  for (float& value : row) value = static_cast<float>(random->Gaussian(1));
  const float norm = std::sqrt(std::inner_product(row.begin(), row.end(), row.begin(), 0.0f));
  for (float& value : row) value /= norm;
  return row;
}

TEST(Vocabulary, EightBitCentresFindWordsAsSimilarAsFloatsDo) {
  constexpr int kDimension = 256, kWords = 200;
  constexpr float kTolerance = 0.005f;  // twice the rounding of a 256-d direction to 8 bits
  Random random(1);
  std::vector<std::vector<float>> centres;
  Descriptors stored(kDimension), image(kDimension);
  for (int i = 0; i < kWords; ++i) {
    centres.push_back(RandomDirection(kDimension, &random));
    stored.Append(centres.back());
  }
  const auto values = stored.stored_values();
  VocabularyTree tree{kDimension, {kWords}, {values.begin(), values.end()}, {}};
  tree.child_counts.resize(kWords + 1);
  tree.idf.assign(kWords, 1.0f);
  const Vocabulary vocabulary(tree);

  std::vector<std::vector<float>> rows;
  for (int i = 0; i < 500; ++i) {
    rows.push_back(RandomDirection(kDimension, &random));
    image.Append(rows.back());
  }
  const std::vector<int> words = vocabulary.WordIndices(image);
  for (size_t i = 0; i < rows.size(); ++i) {
    const auto cosine = [&](size_t word) {
      return std::inner_product(rows[i].begin(), rows[i].end(), centres[word].begin(), 0.0f);
    };
    float best = -1;
    for (size_t word = 0; word < kWords; ++word) best = std::max(best, cosine(word));
    EXPECT_GE(cosine(static_cast<size_t>(words[i])), best - kTolerance);
  }
}

TEST(Vocabulary, DescriptorsOfAnotherDimensionAreRefused) {
  const Vocabulary vocabulary(SmallTree());
  EXPECT_THROW(vocabulary.Words(Descriptors(4)), Error);
  EXPECT_THROW(vocabulary.Assign(Descriptors(2)), Error);
}

TEST(Vocabulary, ShaIsThatOfItsBytes) {
  const Vocabulary vocabulary(SmallTree());
  EXPECT_EQ(vocabulary.sha256(), Sha256(vocabulary.Bytes()));
}

TEST(Vocabulary, TreesThatContradictThemselvesAreRefused) {
  const auto refuses = [](auto damage) {
    VocabularyTree tree = SmallTree();
    damage(tree);
    EXPECT_THROW(Vocabulary{tree}, Error);
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  refuses([](VocabularyTree& tree) { tree = {}; });
  refuses([](VocabularyTree& tree) { tree.dimension = 0; });
  refuses([](VocabularyTree& tree) { tree.dimension = 4; });
  refuses([](VocabularyTree& tree) { tree.child_counts[1] = 1; });
  refuses([](VocabularyTree& tree) { tree.child_counts[0] = 1; });
  refuses([](VocabularyTree& tree) { tree.child_counts = {0, 4, 0, 0, 0}; });
  refuses([](VocabularyTree& tree) { tree.child_counts = {1, 0, 3, 0, 0}; });
  refuses([](VocabularyTree& tree) { tree.child_counts = {2, 0, 65535, 0, 0}; });
  refuses([](VocabularyTree& tree) { tree.idf.pop_back(); });
  refuses([](VocabularyTree& tree) { tree.idf[1] = -1; });
  refuses([nan](VocabularyTree& tree) { tree.idf[1] = nan; });
  refuses([](VocabularyTree& tree) { tree.centres.pop_back(); });
  refuses([](VocabularyTree& tree) { tree.centres[4] = -128; });
  refuses([](VocabularyTree& tree) { tree.centres[0] = 0; });
}

}  // namespace
}  // namespace deepuav
