#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "deepuav/features/descriptors.h"
#include "deepuav/place/bag_of_words.h"

namespace deepuav {

/// What a vocabulary consists of. Nodes are numbered breadth first from the root, 0, so that the
/// children of a node follow one another and those of a later node follow them. Leaves are words,
/// numbered in the order of their nodes.
struct VocabularyTree {
  int dimension = 0;
  std::vector<uint16_t> child_counts;  ///< One a node.
  std::vector<int8_t> centres;  ///< A row a node but the root, -127..127; only directions count.
  std::vector<float> idf;       ///< Inverse document frequency, one a word, at least 0.
};

/// An image in words.
struct WordAssignment {
  BagOfWords words;
  /// Direct index: for each key point a node above its word. Key points that look alike lie under
  /// the same node, mostly.
  std::vector<int> nodes;
};

/// A tree of descriptors (Nister and Stewenius, "Scalable Recognition with a Vocabulary Tree", CVPR
/// 2006): a descriptor goes from the root to the most similar child until it comes to a leaf, its
/// word. Centres are 8-bit integers, and similarities of directions exact integer dot products, so
/// every CPU finds the same words. Const use is thread-safe.
class Vocabulary {
 public:
  /// Throws Error for a tree that contradicts itself.
  explicit Vocabulary(VocabularyTree tree);

  /// Reads a file of Bytes(). Throws Error naming it when it is missing, no vocabulary, newer than
  /// this program, truncated, or changed by a single bit.
  static Vocabulary Load(const std::filesystem::path& file);
  /// The same from the bytes of a file, `name` for messages.
  static Vocabulary FromBytes(std::string_view bytes, const std::string& name);

  /// A vocabulary file (docs/places.md states the format).
  std::string Bytes() const;

  int word_count() const { return static_cast<int>(tree_.idf.size()); }
  int node_count() const { return static_cast<int>(tree_.child_counts.size()); }
  int dimension() const { return tree_.dimension; }
  int depth() const { return depth_; }  ///< Steps from the root to the farthest word.
  /// Of Bytes().
  const std::string& sha256() const { return sha256_; }
  const VocabularyTree& tree() const { return tree_; }

  /// Throws Error for descriptors of another dimension.
  BagOfWords Words(const Descriptors& descriptors) const;
  /// The same with the direct index of the nodes `levels_up` levels above the deepest words (a word
  /// that lies higher is its own node).
  WordAssignment Assign(const Descriptors& descriptors, int levels_up = 2) const;
  /// The word of each descriptor, without weights.
  std::vector<int> WordIndices(const Descriptors& descriptors) const;

  /// Cosine similarity of a descriptor and a word's centre.
  float SimilarityToWord(const Descriptors& descriptors, int row, int word) const;

 private:
  struct Node {
    int first_child = 0, child_count = 0;
    int word = -1;  ///< Of a leaf.
    int depth = 0;
    float inverse_norm = 0;  ///< Of the stored centre.
  };

  void CheckTree() const;
  void LinkNodes();
  const int8_t* Centre(int node) const;
  int MostSimilarChild(const Node& parent, const int8_t* descriptor) const;
  int Descend(const int8_t* descriptor, int index_depth, int* index_node) const;
  /// `nodes` may be null.
  std::vector<int> FindWords(const Descriptors& descriptors, int index_depth,
                             std::vector<int>* nodes) const;
  BagOfWords Weigh(std::vector<int> words) const;

  VocabularyTree tree_;
  std::vector<Node> nodes_;
  std::vector<int> word_nodes_;
  int depth_ = 0;
  std::string sha256_;
};

}  // namespace deepuav
