// What closing a loop costs: the optimisation of a similarity, and the pose graph.

#include <benchmark/benchmark.h>

#include "deepuav/estimation/poses/pose_graph.h"
#include "deepuav/estimation/poses/sim3_optimisation.h"
#include "deepuav/estimation/solvers/block_cholesky.h"
#include "support/sim3_problems.h"

namespace deepuav {
namespace {

/// Range 0: correspondences, 1: percent of them wrong.
SyntheticSim3 Problem(const benchmark::State& state) {
  Random random(1);
  return MakeSim3Problem(static_cast<int>(state.range(0)), 1.3,
                         {1, 0.05, 0.01 * static_cast<double>(state.range(1))}, &random);
}

void Sim3Optimisation(benchmark::State& state) {
  const SyntheticSim3 problem = Problem(state);
  const Sim3 initial = Sim3::Exp(Vector7d::Constant(0.02)) * problem.a_from_b;
  for (auto _ : state) {
    benchmark::DoNotOptimize(OptimiseSim3(problem.pinhole, problem.correspondences, initial, {}));
  }
}
BENCHMARK(Sim3Optimisation)
    ->ArgNames({"correspondences", "outlier_percent"})
    ->ArgsProduct({{100, 300}, {20}})
    ->Unit(benchmark::kMicrosecond);

/// Four laps: each keyframe has edges with its predecessors, and every tenth one a true edge with
/// its like in the lap before. Range 0: keyframes, 1: predecessors.
PoseGraph FlightWithLoops(const benchmark::State& state) {
  Random random(1);
  const int keyframes = static_cast<int>(state.range(0)), laps = 4;
  SyntheticLoop loop =
      MakeDriftingLoop(keyframes, laps, static_cast<int>(state.range(1)), 0.5, 0.4, &random, 0.002);
  for (int i = keyframes / laps; i < keyframes; i += 10) {
    const int before = i - keyframes / laps;
    loop.graph.edges.push_back(
        {i, before, Sim3(loop.truth[i] * loop.truth[before].Inverse(), std::exp(0.1)), 1});
  }
  return loop.graph;
}

void PoseGraphOptimisation(benchmark::State& state) {
  const PoseGraph graph = FlightWithLoops(state);
  PoseGraphReport report;
  for (auto _ : state) {
    PoseGraph copy = graph;
    report = OptimisePoseGraph(&copy, {});
  }
  state.counters["edges"] = static_cast<double>(graph.edges.size());
  state.counters["steps"] = report.iterations;
  state.counters["initial_cost"] = report.initial_cost;
  state.counters["final_cost"] = report.final_cost;
}
BENCHMARK(PoseGraphOptimisation)
    ->ArgNames({"keyframes", "predecessors"})
    ->Args({500, 10})
    ->Args({2000, 5})
    ->Args({2000, 10})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace deepuav
