#include "deepuav/place/vocabulary_training.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

constexpr int kDimension = 32;

using Direction = std::vector<float>;

Direction Normalised(Direction row) {
  const float norm = std::sqrt(std::inner_product(row.begin(), row.end(), row.begin(), 0.0f));
  for (float& value : row) value /= norm;
  return row;
}

Direction Near(const Direction& centre, double sigma, Random* random) {
  Direction row = centre;
  for (float& value : row) value += static_cast<float>(random->Gaussian(sigma));
  return Normalised(row);
}

Direction AnyDirection(Random* random) { return Near(Direction(kDimension, 0.0f), 1, random); }

/// Groups of clusters, as a tree of two levels has them: `outer` groups of `inner` clusters.
std::vector<Direction> PlantClusters(int outer, int inner, Random* random) {
  std::vector<Direction> clusters;
  for (int i = 0; i < outer; ++i) {
    const Direction group = AnyDirection(random);
    for (int j = 0; j < inner; ++j) clusters.push_back(Near(group, 0.08, random));
  }
  return clusters;
}

/// Images that show every cluster, one descriptor near each.
std::vector<Descriptors> ImagesOf(const std::vector<Direction>& clusters, int count,
                                  Random* random) {
  std::vector<Descriptors> images(static_cast<size_t>(count), Descriptors(kDimension));
  for (Descriptors& image : images) {
    for (const Direction& cluster : clusters) image.Append(Near(cluster, 0.01, random));
  }
  return images;
}

VocabularyOptions SmallOptions() {
  VocabularyOptions options;
  options.branching = 4;
  options.depth = 2;
  options.split_descriptors = 20;
  return options;
}

TEST(TrainVocabulary, FindsPlantedClusters) {
  constexpr int kOuter = 4, kInner = 4;
  Random random(1);
  const std::vector<Direction> clusters = PlantClusters(kOuter, kInner, &random);
  const auto images = ImagesOf(clusters, 60, &random);
  const Vocabulary vocabulary = TrainVocabulary(images, SmallOptions());
  ASSERT_EQ(vocabulary.word_count(), kOuter * kInner);
  EXPECT_EQ(vocabulary.depth(), 2);

  Descriptors exact(kDimension);
  for (const Direction& cluster : clusters) exact.Append(cluster);
  const std::vector<int> words = vocabulary.WordIndices(exact);
  EXPECT_EQ(std::set<int>(words.begin(), words.end()).size(), clusters.size());
  for (const Descriptors& image : images) EXPECT_EQ(vocabulary.WordIndices(image), words);
  for (int i = 0; i < exact.size(); ++i)
    EXPECT_GT(vocabulary.SimilarityToWord(exact, i, words[static_cast<size_t>(i)]), 0.99f);
  // The clusters of a group share a node.
  const std::vector<int> nodes = vocabulary.Assign(exact, 1).nodes;
  for (size_t i = 0; i < nodes.size(); ++i) EXPECT_EQ(nodes[i], nodes[i / kInner * kInner]);
}

TEST(TrainVocabulary, WeighsWordsByTheImagesThatShowThem) {
  Random random(2);
  VocabularyOptions options;
  options.branching = 3;
  options.depth = 1;
  std::vector<Direction> clusters;
  for (int i = 0; i < 3; ++i) clusters.push_back(AnyDirection(&random));
  std::vector<Descriptors> images(8, Descriptors(kDimension));
  for (size_t i = 0; i < images.size(); ++i) {
    for (int repeat = 0; repeat < 5; ++repeat) {
      images[i].Append(Near(clusters[0], 0.01, &random));
      if (i < 4) images[i].Append(Near(clusters[1], 0.01, &random));
      if (i < 1) images[i].Append(Near(clusters[2], 0.01, &random));
    }
  }
  const Vocabulary vocabulary = TrainVocabulary(images, options);
  ASSERT_EQ(vocabulary.word_count(), 3);
  const std::vector<int> words = vocabulary.WordIndices(images[0]);
  const auto idf = [&](size_t row) {
    return vocabulary.tree().idf[static_cast<size_t>(words[row])];
  };
  EXPECT_FLOAT_EQ(idf(0), 0);
  EXPECT_FLOAT_EQ(idf(1), std::log(2.0f));
  EXPECT_FLOAT_EQ(idf(2), std::log(8.0f));
}

TEST(TrainVocabulary, IsTheSameAgainWhateverElseDrawsRandomNumbers) {
  Random random(3);
  const auto images = ImagesOf(PlantClusters(6, 5, &random), 40, &random);
  const std::string bytes = TrainVocabulary(images, SmallOptions()).Bytes();
  const cv::RNG before = cv::theRNG();
  EXPECT_EQ(TrainVocabulary(images, SmallOptions()).Bytes(), bytes);
  EXPECT_EQ(cv::theRNG().state, before.state);
  cv::theRNG() = cv::RNG(99);
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  EXPECT_EQ(TrainVocabulary(images, SmallOptions()).Bytes(), bytes);
  cv::setNumThreads(threads);

  VocabularyOptions other_seed = SmallOptions();
  other_seed.seed = 2;
  EXPECT_NE(TrainVocabulary(images, other_seed).Bytes(), bytes);
}

TEST(TrainVocabulary, AFewSamplesFindTheClustersToo) {
  Random random(4);
  const std::vector<Direction> clusters = PlantClusters(4, 4, &random);
  const auto images = ImagesOf(clusters, 60, &random);
  VocabularyOptions options = SmallOptions();
  options.cluster_descriptors = 200;
  EXPECT_EQ(TrainVocabulary(images, options).word_count(), 16);
}

TEST(TrainVocabulary, EqualAndZeroDescriptorsMakeFewWords) {
  Random random(5);
  Descriptors image(kDimension);
  const Direction a = AnyDirection(&random), b = AnyDirection(&random);
  for (int i = 0; i < 100; ++i) {
    image.Append(i % 2 == 0 ? a : b);
    image.Append(Direction(kDimension, 0.0f));
  }
  const std::vector<Descriptors> images(3, image);
  const Vocabulary vocabulary = TrainVocabulary(images, SmallOptions());
  EXPECT_EQ(vocabulary.word_count(), 2);
  EXPECT_NE(vocabulary.WordIndices(image)[0], vocabulary.WordIndices(image)[2]);
}

TEST(TrainVocabulary, OppositeDescriptorsHaveNoMeanDirection) {
  Descriptors image(2);
  for (int i = 0; i < 50; ++i) {
    image.Append(Direction{1, 0});
    image.Append(Direction{-1, 0});
    image.Append(Direction{0, 1});
    image.Append(Direction{0, -1});
  }
  VocabularyOptions options;
  options.branching = 2;
  const std::vector<Descriptors> images(2, image);
  const Vocabulary vocabulary = TrainVocabulary(images, options);
  const std::vector<int> words = vocabulary.WordIndices(image);
  EXPECT_EQ(std::set<int>(words.begin(), words.end()).size(), 4u);
}

TEST(TrainVocabulary, TooLittleIsRefused) {
  Random random(6);
  EXPECT_THROW(TrainVocabulary({}, SmallOptions()), Error);
  std::vector<Descriptors> images(1, Descriptors(kDimension));
  EXPECT_THROW(TrainVocabulary(images, SmallOptions()), Error);
  for (int i = 0; i < 3; ++i) images[0].Append(AnyDirection(&random));
  EXPECT_THROW(TrainVocabulary(images, SmallOptions()), Error);
  images[0].Append(AnyDirection(&random));
  EXPECT_EQ(TrainVocabulary(images, SmallOptions()).word_count(), 4);
  images.emplace_back(kDimension + 1);
  EXPECT_THROW(TrainVocabulary(images, SmallOptions()), Error);
}

TEST(VocabularyOptions, ImpossibleOnesAreRefused) {
  const auto refuses = [](auto change) {
    VocabularyOptions options;
    options.Check();
    change(options);
    EXPECT_THROW(options.Check(), Error);
  };
  refuses([](VocabularyOptions& options) { options.branching = 1; });
  refuses([](VocabularyOptions& options) { options.branching = 1001; });
  refuses([](VocabularyOptions& options) { options.depth = 0; });
  refuses([](VocabularyOptions& options) { options.iterations = 0; });
  refuses([](VocabularyOptions& options) { options.cluster_descriptors = 9; });
  refuses([](VocabularyOptions& options) { options.split_descriptors = 1; });
  refuses([](VocabularyOptions& options) { options.seed = -1; });
}

TEST(MeasureQuantisation, CountsByHand) {
  VocabularyTree tree;
  tree.dimension = 2;
  tree.child_counts = {3, 0, 0, 0};
  tree.centres = {127, 0, 0, 127, -127, 0};
  tree.idf = {1, 1, 1};
  std::vector<Descriptors> images(2, Descriptors(2));
  images[0].Append(Direction{1, 0});
  images[0].Append(Direction{0.8f, 0.6f});
  images[0].Append(Direction{0, 1});
  images[1].Append(Direction{1, 0});
  const auto statistics = MeasureQuantisation(Vocabulary(tree), images);
  EXPECT_EQ(statistics.images, 2);
  EXPECT_EQ(statistics.descriptors, 4);
  EXPECT_EQ(statistics.used_words, 2);
  EXPECT_NEAR(statistics.mean_similarity, 3.8 / 4, 0.005);
  EXPECT_DOUBLE_EQ(statistics.mean_words_per_image, 1.5);
  EXPECT_DOUBLE_EQ(statistics.mean_images_per_word, 1.5);
  EXPECT_DOUBLE_EQ(statistics.largest_image_fraction, 1);
}

}  // namespace
}  // namespace deepuav
