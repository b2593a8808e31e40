#include <benchmark/benchmark.h>

#include <cmath>

#include "deepuav/base/random.h"
#include "deepuav/features/superpoint_postprocessing.h"

namespace deepuav {
namespace {

constexpr int kRows = 60, kColumns = 94, kDimension = 256;  // of 752x480 pixels
constexpr int kKeypoints = 1000;

/// One likely pixel in about every third cell, with the cell's other pixels falling off around it.
std::vector<float> SyntheticLogits() {
  Random random(1);
  std::vector<float> logits(kSuperPointLogits * kRows * kColumns);
  for (int cell = 0; cell < kRows * kColumns; ++cell) {
    const double x = random.Uniform(0, 8), y = random.Uniform(0, 8);
    const bool has_point = random.Index(3) == 0;
    for (int channel = 0; channel < kSuperPointLogits; ++channel) {
      const double distance = std::hypot(channel % 8 - x, channel / 8 - y);
      double logit = random.Uniform(-1, 1) - 2 * distance;
      if (channel == kSuperPointLogits - 1) logit = has_point ? -1 : 8;
      logits[static_cast<size_t>(cell * kSuperPointLogits + channel)] = static_cast<float>(logit);
    }
  }
  return logits;
}

struct Prepared {
  Prepared()
      : heat_map(kRows * kColumns * 64),
        descriptors(kRows * kColumns * kDimension),
        inverse_lengths(kRows * kColumns) {
    LogitsToHeatMap(SyntheticLogits(), kRows, kColumns, heat_map, &scratch);
    peaks = FindPeaks(Map(), {});
    Random random(2);
    for (float& value : descriptors) value = static_cast<float>(random.Gaussian(1.0 / 16));
    InverseLengths(descriptors, inverse_lengths);
  }
  HeatMap Map() const { return {heat_map.data(), 8 * kColumns, 8 * kRows, 8 * kColumns}; }

  std::vector<float> heat_map, scratch, descriptors, inverse_lengths;
  std::vector<Peak> peaks;
};

void BM_LogitsToHeatMap(benchmark::State& state) {
  Prepared prepared;
  const auto logits = SyntheticLogits();
  for (auto _ : state)
    LogitsToHeatMap(logits, kRows, kColumns, prepared.heat_map, &prepared.scratch);
}
BENCHMARK(BM_LogitsToHeatMap)->Unit(benchmark::kMillisecond);

void BM_InverseLengths(benchmark::State& state) {
  Prepared prepared;
  for (auto _ : state) InverseLengths(prepared.descriptors, prepared.inverse_lengths);
}
BENCHMARK(BM_InverseLengths)->Unit(benchmark::kMillisecond);

void BM_FindPeaks(benchmark::State& state) {
  const Prepared prepared;
  PeakOptions options;
  options.count = kKeypoints;
  for (auto _ : state) benchmark::DoNotOptimize(FindPeaks(prepared.Map(), options));
  state.counters["peaks"] = static_cast<double>(prepared.peaks.size());
}
BENCHMARK(BM_FindPeaks)->Unit(benchmark::kMillisecond);

void BM_RefinePeaks(benchmark::State& state) {
  const Prepared prepared;
  const PeakRefiner refiner(1.0, 1.0);
  for (auto _ : state) {
    for (const Peak& peak : prepared.peaks)
      benchmark::DoNotOptimize(refiner.Refine(prepared.Map(), peak));
  }
}
BENCHMARK(BM_RefinePeaks)->Unit(benchmark::kMillisecond);

void BM_SampleDescriptors(benchmark::State& state) {
  const Prepared prepared;
  std::vector<float> descriptor(kDimension);
  const DescriptorMap map{prepared.descriptors.data(), prepared.inverse_lengths.data(), kRows,
                          kColumns, kDimension};
  for (auto _ : state) {
    for (const Peak& peak : prepared.peaks) {
      SampleDescriptor(map, {static_cast<float>(peak.x) + 0.3f, static_cast<float>(peak.y)},
                       descriptor);
      benchmark::DoNotOptimize(descriptor.data());
    }
  }
}
BENCHMARK(BM_SampleDescriptors)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace deepuav
