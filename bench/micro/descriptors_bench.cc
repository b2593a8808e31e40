#include <benchmark/benchmark.h>

#include "deepuav/base/random.h"
#include "deepuav/features/descriptors.h"
#include "deepuav/features/dot_kernels.h"

namespace deepuav {
namespace {

constexpr int kDimension = 256;

Descriptors RandomDescriptors(int rows, uint64_t seed) {
  Random random(seed);
  Descriptors descriptors(kDimension);
  std::vector<float> row(kDimension);
  for (int i = 0; i < rows; ++i) {
    for (float& value : row) value = static_cast<float>(random.Gaussian(1.0 / 16));
    descriptors.Append(row);
  }
  return descriptors;
}

void BM_SimilarityMatrix(benchmark::State& state) {
  const int rows = static_cast<int>(state.range(0));
  const Descriptors a = RandomDescriptors(rows, 1), b = RandomDescriptors(rows, 2);
  std::vector<float> out(static_cast<size_t>(rows) * static_cast<size_t>(rows));
  for (auto _ : state) {
    a.SimilarityMatrix(b, out);
    benchmark::DoNotOptimize(out.data());
  }
}
BENCHMARK(BM_SimilarityMatrix)->Arg(500)->Arg(1000)->Arg(2000)->Unit(benchmark::kMillisecond);

void BM_DotKernelsMatrix(benchmark::State& state) {
  constexpr int kRows = 1000;
  const auto& kernels = AvailableDotKernels();
  const auto index = static_cast<size_t>(state.range(0));
  if (index >= kernels.size()) {
    state.SkipWithError("not on this CPU");
    return;
  }
  state.SetLabel(kernels[index].name);
  Random random(3);
  std::vector<int8_t> values(kRows * kDimension);
  for (int8_t& value : values) value = static_cast<int8_t>(random.Index(255) - 127);
  const std::vector<float> scales(kRows, 1.0f);
  std::vector<float> out(kRows * kRows);
  const ScaledRows rows{values.data(), scales.data(), kRows};
  for (auto _ : state) {
    kernels[index].matrix(rows, rows, kDimension, out.data());
    benchmark::DoNotOptimize(out.data());
  }
}
BENCHMARK(BM_DotKernelsMatrix)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

void BM_Similarity(benchmark::State& state) {
  constexpr int kRows = 1000;
  const Descriptors a = RandomDescriptors(kRows, 1), b = RandomDescriptors(kRows, 2);
  int i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(a.Similarity(i, b, kRows - 1 - i));
    i = (i + 1) % kRows;
  }
}
BENCHMARK(BM_Similarity);

void BM_Append(benchmark::State& state) {
  const Descriptors source = RandomDescriptors(1, 1);
  std::vector<float> row(kDimension);
  source.Read(0, row);
  Descriptors descriptors(kDimension);
  for (auto _ : state) {
    if (descriptors.size() == 1000) descriptors = Descriptors(kDimension);
    descriptors.Append(row);
  }
}
BENCHMARK(BM_Append);

}  // namespace
}  // namespace deepuav
