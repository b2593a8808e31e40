#include <benchmark/benchmark.h>

#include "deepuav/base/random.h"
#include "deepuav/place/place_index.h"
#include "deepuav/place/vocabulary.h"

namespace deepuav {
namespace {

constexpr int kDimension = 256;
constexpr int kBranching = 10, kDepth = 4;
constexpr int kKeypoints = 1000;

Descriptors RandomDescriptors(int rows, Random* random) {
  Descriptors descriptors(kDimension);
  std::vector<float> row(kDimension);
  for (int i = 0; i < rows; ++i) {
    for (float& value : row) value = static_cast<float>(random->Gaussian(1.0 / 16));
    descriptors.Append(row);
  }
  return descriptors;
}

/// A full tree of random centres.
Vocabulary RandomVocabulary() {
  Random random(1);
  VocabularyTree tree;
  tree.dimension = kDimension;
  size_t level = 1;
  for (int depth = 0; depth < kDepth; ++depth, level *= kBranching)
    tree.child_counts.resize(tree.child_counts.size() + level, kBranching);
  tree.child_counts.resize(tree.child_counts.size() + level, 0);
  tree.centres.resize((tree.child_counts.size() - 1) * kDimension);
  for (int8_t& value : tree.centres) value = static_cast<int8_t>(random.Index(255) - 127);
  tree.idf.assign(level, 1.0f);
  return Vocabulary(std::move(tree));
}

void BM_Words(benchmark::State& state) {
  const Vocabulary vocabulary = RandomVocabulary();
  Random random(2);
  const Descriptors image = RandomDescriptors(kKeypoints, &random);
  for (auto _ : state) benchmark::DoNotOptimize(vocabulary.Words(image));
}
BENCHMARK(BM_Words)->Unit(benchmark::kMillisecond);

/// About as many different words as an image shows.
BagOfWords RandomBag(Random* random) {
  constexpr int kVocabularyWords = 10000, kLargestStep = 40;
  BagOfWords bag;
  for (int word = 0; word < kVocabularyWords; word += 1 + random->Index(kLargestStep))
    bag.push_back({word, 0});
  for (WordWeight& entry : bag) entry.weight = 1 / static_cast<float>(bag.size());
  return bag;
}

void BM_Query(benchmark::State& state) {
  constexpr int kHits = 10, kDifferentBags = 200;
  Random random(3);
  std::vector<BagOfWords> bags(kDifferentBags);
  for (BagOfWords& bag : bags) bag = RandomBag(&random);
  PlaceIndex index;
  for (int id = 0; id < state.range(0); ++id)
    index.Add(KeyframeId{id}, bags[static_cast<size_t>(id % kDifferentBags)]);
  for (auto _ : state) benchmark::DoNotOptimize(index.Query(bags.front(), kHits));
}
BENCHMARK(BM_Query)->Arg(200)->Arg(2000)->Arg(20000)->Unit(benchmark::kMillisecond);

void BM_LoadVocabulary(benchmark::State& state) {
  const std::string bytes = RandomVocabulary().Bytes();
  for (auto _ : state) benchmark::DoNotOptimize(Vocabulary::FromBytes(bytes, "bench"));
}
BENCHMARK(BM_LoadVocabulary)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace deepuav
