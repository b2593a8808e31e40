#include <benchmark/benchmark.h>

#include "deepuav/base/random.h"
#include "deepuav/matching/best_two_scan.h"
#include "deepuav/matching/nearest_neighbour.h"

namespace deepuav {
namespace {

constexpr int kDimension = 256;

Features RandomFeatures(int count, uint64_t seed) {
  Random random(seed);
  Features features{{}, Descriptors(kDimension)};
  features.keypoints.resize(static_cast<size_t>(count));
  std::vector<float> row(kDimension);
  for (int i = 0; i < count; ++i) {
    for (float& value : row) value = static_cast<float>(random.Gaussian(1.0 / 16));
    features.descriptors.Append(row);
  }
  return features;
}

void BM_FindBestTwo(benchmark::State& state) {
  const auto rows = static_cast<size_t>(state.range(0));
  Random random(1);
  std::vector<float> matrix(rows * rows);
  for (float& value : matrix) value = static_cast<float>(random.Uniform(-1, 1));
  for (auto _ : state) benchmark::DoNotOptimize(FindBestTwo(matrix, rows, rows));
}
BENCHMARK(BM_FindBestTwo)->Arg(500)->Arg(1000)->Unit(benchmark::kMillisecond);

void BM_MatchNearestNeighbours(benchmark::State& state) {
  const int count = static_cast<int>(state.range(0));
  const Features a = RandomFeatures(count, 1), b = RandomFeatures(count, 2);
  NearestNeighbourMatcher matcher({});
  for (auto _ : state) benchmark::DoNotOptimize(matcher.MatchFeatures(a, b));
}
BENCHMARK(BM_MatchNearestNeighbours)->Arg(500)->Arg(1000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace deepuav
