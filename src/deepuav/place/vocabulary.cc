#include "deepuav/place/vocabulary.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/base/sha256.h"
#include "deepuav/features/dot_kernels.h"

namespace deepuav {

Vocabulary::Vocabulary(VocabularyTree tree) : tree_(std::move(tree)) {
  CheckTree();
  LinkNodes();
  sha256_ = Sha256(Bytes());
}

void Vocabulary::CheckTree() const {
  if (tree_.dimension < 1)
    throw Error("a vocabulary of dimension {}: expected at least 1", tree_.dimension);
  const size_t count = tree_.child_counts.size();
  if (count < 2) throw Error("a vocabulary of {} nodes: expected at least 2", count);
  size_t linked = 1;
  for (size_t node = 0; node < count; ++node) {
    if (node >= linked) throw Error("node {} of the vocabulary has no parent", node);
    linked += tree_.child_counts[node];
  }
  if (linked != count)
    throw Error("the vocabulary has {} nodes: expected the {} that are linked", count, linked);
  const auto words = static_cast<size_t>(
      std::count(tree_.child_counts.begin(), tree_.child_counts.end(), uint16_t{0}));
  if (tree_.idf.size() != words)
    throw Error("the vocabulary weighs {} words: expected {}", tree_.idf.size(), words);
  for (const float idf : tree_.idf) {
    if (!std::isfinite(idf) || idf < 0)
      throw Error("a word weighs {}: expected a finite weight, not negative", idf);
  }
  if (tree_.centres.size() != (count - 1) * static_cast<size_t>(tree_.dimension)) {
    throw Error("the vocabulary has {} values of centres: expected {} rows of {}",
                tree_.centres.size(), count - 1, tree_.dimension);
  }
  if (std::find(tree_.centres.begin(), tree_.centres.end(), INT8_MIN) != tree_.centres.end())
    throw Error("a centre has the value -128: expected -127 to 127");
}

void Vocabulary::LinkNodes() {
  nodes_.resize(tree_.child_counts.size());
  int next_child = 1;
  for (int index = 0; index < node_count(); ++index) {
    Node& node = nodes_[static_cast<size_t>(index)];
    node.first_child = next_child;
    node.child_count = tree_.child_counts[static_cast<size_t>(index)];
    next_child += node.child_count;
    for (int child = node.first_child; child < next_child; ++child)
      nodes_[static_cast<size_t>(child)].depth = node.depth + 1;
    depth_ = std::max(depth_, node.depth);
    if (node.child_count == 0) {
      node.word = static_cast<int>(word_nodes_.size());
      word_nodes_.push_back(index);
    }
    if (index == 0) continue;
    const int32_t squares = FastestDotKernels().dot(Centre(index), Centre(index), dimension());
    if (squares == 0) throw Error("the centre of node {} has no direction", index);
    node.inverse_norm = 1 / std::sqrt(static_cast<float>(squares));
  }
}

const int8_t* Vocabulary::Centre(int node) const {
  return tree_.centres.data() + static_cast<ptrdiff_t>(node - 1) * tree_.dimension;
}

int Vocabulary::MostSimilarChild(const Node& parent, const int8_t* descriptor) const {
  const auto dot = FastestDotKernels().dot;
  const Node* children = nodes_.data() + parent.first_child;
  const int8_t* centre = Centre(parent.first_child);
  int best = 0;
  float best_similarity = -std::numeric_limits<float>::infinity();
  for (int i = 0; i < parent.child_count; ++i, centre += tree_.dimension) {
    const float similarity =
        static_cast<float>(dot(descriptor, centre, tree_.dimension)) * children[i].inverse_norm;
    if (similarity > best_similarity) {
      best = i;
      best_similarity = similarity;
    }
  }
  return parent.first_child + best;
}

int Vocabulary::Descend(const int8_t* descriptor, int index_depth, int* index_node) const {
  int index = 0;
  while (true) {
    const Node& node = nodes_[static_cast<size_t>(index)];
    if (node.depth <= index_depth) *index_node = index;
    if (node.child_count == 0) return node.word;
    index = MostSimilarChild(node, descriptor);
  }
}

std::vector<int> Vocabulary::FindWords(const Descriptors& descriptors, int index_depth,
                                       std::vector<int>* nodes) const {
  if (descriptors.dimension() != dimension()) {
    throw Error("descriptors of dimension {}: expected the vocabulary's {}",
                descriptors.dimension(), dimension());
  }
  std::vector<int> words(static_cast<size_t>(descriptors.size()));
  if (nodes) nodes->resize(words.size());
  const int8_t* descriptor = descriptors.stored_values().data();
  for (size_t i = 0; i < words.size(); ++i, descriptor += dimension()) {
    int node = 0;
    words[i] = Descend(descriptor, index_depth, &node);
    if (nodes) (*nodes)[i] = node;
  }
  return words;
}

BagOfWords Vocabulary::Weigh(std::vector<int> words) const {
  std::sort(words.begin(), words.end());
  BagOfWords bag;
  double sum = 0;
  for (size_t begin = 0, end = 0; begin < words.size(); begin = end) {
    const int word = words[begin];
    while (end < words.size() && words[end] == word) ++end;
    const float weight = static_cast<float>(end - begin) * tree_.idf[static_cast<size_t>(word)];
    if (weight == 0) continue;
    bag.push_back({word, weight});
    sum += weight;
  }
  for (WordWeight& entry : bag) entry.weight = static_cast<float>(entry.weight / sum);
  return bag;
}

std::vector<int> Vocabulary::WordIndices(const Descriptors& descriptors) const {
  return FindWords(descriptors, 0, nullptr);
}

BagOfWords Vocabulary::Words(const Descriptors& descriptors) const {
  return Weigh(WordIndices(descriptors));
}

WordAssignment Vocabulary::Assign(const Descriptors& descriptors, int levels_up) const {
  WordAssignment assignment;
  assignment.words =
      Weigh(FindWords(descriptors, std::max(depth_ - levels_up, 0), &assignment.nodes));
  return assignment;
}

float Vocabulary::SimilarityToWord(const Descriptors& descriptors, int row, int word) const {
  const int node = word_nodes_[static_cast<size_t>(word)];
  const int8_t* descriptor =
      descriptors.stored_values().data() + static_cast<ptrdiff_t>(row) * dimension();
  const int32_t dot = FastestDotKernels().dot(descriptor, Centre(node), dimension());
  return static_cast<float>(dot) * descriptors.scales()[static_cast<size_t>(row)] *
         nodes_[static_cast<size_t>(node)].inverse_norm;
}

}  // namespace deepuav
