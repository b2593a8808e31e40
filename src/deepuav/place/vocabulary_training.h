#pragma once

#include <cstdint>
#include <span>

#include "deepuav/base/option_bounds.h"
#include "deepuav/features/descriptors.h"
#include "deepuav/place/vocabulary.h"

namespace deepuav {

struct VocabularyOptions {
  int branching = 10;
  int depth = 4;
  int iterations = 25;
  int cluster_descriptors = 100000;
  int split_descriptors = 50;
  int seed = 1;

  void Check() const;
  /// Throws OptionError where two options contradict each other.
  void CheckRelations() const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("branching", branching, "", "children that a node of the tree is split into",
          Between(2, 1000));
    visit("depth", depth, "", "levels of the tree; there are at most branching^depth words",
          Between(1, 10));
    visit("iterations", iterations, "", "rounds of k-means at a node, at most", Between(1, 1000));
    visit("cluster_descriptors", cluster_descriptors, "",
          "descriptors, evenly taken, from which k-means finds the children of a node",
          Between(2, 100'000'000));
    visit("split_descriptors", split_descriptors, "",
          "a node with fewer descriptors is a word and not split", Between(2, 100'000'000));
    visit("seed", seed, "", "seed of the first centres of k-means", AnySeed());
  }
};

/// Clusters the descriptors of images by hierarchical k-means (k-means++ seeding) on directions,
/// and weighs each word by ln(images / images that show it). The same input and options give the
/// same bytes. Throws Error for images of different dimensions, and where there are fewer
/// descriptors than branching.
Vocabulary TrainVocabulary(std::span<const Descriptors> images, const VocabularyOptions& options);

/// How well a vocabulary fits descriptors.
struct QuantisationStatistics {
  int images = 0;
  int64_t descriptors = 0;
  int used_words = 0;
  double mean_similarity = 0;         ///< Cosine of a descriptor and its word's centre.
  double mean_words_per_image = 0;    ///< Different ones.
  double mean_images_per_word = 0;    ///< Over the words used.
  double largest_image_fraction = 0;  ///< Images that show the most common word.
};

QuantisationStatistics MeasureQuantisation(const Vocabulary& vocabulary,
                                           std::span<const Descriptors> images);

}  // namespace deepuav
