// Bundle adjustment: the library's own against Ceres, on the same problem, for the same number of
// steps.

#include <benchmark/benchmark.h>

#include <cmath>

#include "bundle_ceres.h"
#include "deepuav/estimation/bundle/bundle_linearisation.h"
#include "deepuav/estimation/bundle/reduced_camera_system.h"
#include "support/estimation_problems.h"

namespace deepuav {
namespace {

constexpr int kSteps = 5;
constexpr double kHeight = 60;

/// A survey flight straight down over relief, disturbed. `across` and `along`: footprints over
/// camera spacing, so that a landmark is seen about across * along times.
BundleProblem SurveyProblem(int rows, int columns, double across, double along, int landmarks) {
  Random random(1);
  SyntheticWorld world;
  const double footprint_x =
      kHeight * world.height / world.pinhole.fy;  // LookDown: the top of the image is forward.
  const double footprint_y = kHeight * world.width / world.pinhole.fx;
  const double step_x = footprint_x / along, step_y = rows > 1 ? footprint_y / across : 0;
  for (int row = 0; row < rows; ++row) {
    for (int i = 0; i < columns; ++i) {
      const int column = row % 2 == 0 ? i : columns - 1 - i;
      world.cam_from_world.push_back(
          LookDown({column * step_x, row * step_y, kHeight}, row % 2 == 0 ? 0 : M_PI));
    }
  }
  world.landmarks_world = LandmarksOnGround(
      landmarks, {-footprint_x / 4, -footprint_y / 4},
      {(columns - 1) * step_x + footprint_x / 4, (rows - 1) * step_y + footprint_y / 4}, 3,
      &random);
  BundleProblem problem = MakeBundleProblem(world, {1, 0.02}, &random);
  problem.camera_fixed[1] = 1;
  for (size_t i = 2; i < problem.cam_from_world.size(); ++i) {
    problem.cam_from_world[i] = Perturbed(problem.cam_from_world[i], 0.3, 0.01, &random);
  }
  for (auto& landmark : problem.landmarks_world) landmark += 0.5 * RandomDirection(&random);
  return problem;
}

/// 20 keyframes, about 3,000 landmarks with 6 observations each: a local adjustment.
BundleProblem Window() { return SurveyProblem(1, 20, 1, 6.5, 3000); }
/// 1,000 keyframes, 30,000 landmarks, 300,000 observations: the final adjustment of a flight.
BundleProblem Flight() { return SurveyProblem(20, 50, 2.5, 4.3, 30000); }

void Count(benchmark::State& state, const BundleProblem& problem, int steps, double cost) {
  state.counters["observations"] = static_cast<double>(problem.observations.size());
  state.counters["steps"] = steps;
  state.counters["final_cost"] = cost;
  state.counters["time_per_step"] = benchmark::Counter(
      steps, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void Own(benchmark::State& state, const BundleProblem& problem) {
  BundleOptions options;
  options.max_iterations = kSteps;
  options.min_relative_decrease = 0;
  BundleReport report;
  for (auto _ : state) {
    BundleProblem copy = problem;
    report = AdjustBundle(&copy, options);
  }
  Count(state, problem, report.iterations, report.final_cost);
}

void Ceres(benchmark::State& state, const BundleProblem& problem, CeresSchur schur) {
  CeresReport report;
  for (auto _ : state) {
    BundleProblem copy = problem;
    report = AdjustBundleByCeres(&copy, BundleOptions().chi_square, kSteps, schur);
  }
  Count(state, problem, report.iterations, report.final_cost);
}

void WindowOwn(benchmark::State& state) { Own(state, Window()); }
void WindowCeresDense(benchmark::State& state) { Ceres(state, Window(), CeresSchur::kDense); }
void WindowCeresSparse(benchmark::State& state) { Ceres(state, Window(), CeresSchur::kSparse); }
void FlightOwn(benchmark::State& state) { Own(state, Flight()); }
void FlightCeresSparse(benchmark::State& state) { Ceres(state, Flight(), CeresSchur::kSparse); }

/// The adjustment after a loop: range 0: keyframes; 60,000 landmarks.
void GlobalOwn(benchmark::State& state) {
  Own(state, SurveyProblem(static_cast<int>(state.range(0)) / 25, 25, 2.5, 4.3, 60000));
}
void GlobalCeresSparse(benchmark::State& state) {
  Ceres(state, SurveyProblem(static_cast<int>(state.range(0)) / 25, 25, 2.5, 4.3, 60000),
        CeresSchur::kSparse);
}

BENCHMARK(GlobalOwn)->Arg(100)->Arg(300)->Arg(600)->Unit(benchmark::kMillisecond);
BENCHMARK(GlobalCeresSparse)->Arg(600)->Unit(benchmark::kMillisecond);
BENCHMARK(WindowOwn)->Unit(benchmark::kMillisecond);
BENCHMARK(WindowCeresDense)->Unit(benchmark::kMillisecond);
BENCHMARK(WindowCeresSparse)->Unit(benchmark::kMillisecond);
BENCHMARK(FlightOwn)->Unit(benchmark::kMillisecond);
BENCHMARK(FlightCeresSparse)->Unit(benchmark::kMillisecond);

/// One solve of the reduced system; range 0: cameras, 1: sparse or dense, 2: neighbours that share
/// landmarks with a camera, before and behind it.
void ReducedSystem(benchmark::State& state) {
  const int cameras = static_cast<int>(state.range(0));
  const BundleProblem problem =
      SurveyProblem(1, cameras, 1, static_cast<double>(state.range(2)) + 0.5, 30 * cameras);
  const BundleStructure structure(problem);
  BundleLinearisation linearisation;
  linearisation.Compute(structure,
                        {{problem.pinhole, 0, 0}, problem.cam_from_world, problem.landmarks_world},
                        HuberLoss{BundleOptions().chi_square}, {false, false});
  ReducedCameraSystem system(structure, state.range(1) ? 1 : cameras + 1);
  BundleStep step;
  for (auto _ : state) system.Solve(linearisation, 1e-4, &step);
}
BENCHMARK(ReducedSystem)
    ->ArgNames({"cameras", "sparse", "neighbours"})
    ->ArgsProduct({{20, 50, 100, 200, 400}, {0, 1}, {5, 20}})
    ->Unit(benchmark::kMillisecond);

/// One motion-only optimisation of a frame with 300 observations, 10 % of them wrong.
void MotionOnly(benchmark::State& state) {
  Random random(1);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(700, {-6, -4, 4}, {6, 4, 15}, &random);
  auto observations = ObservePose(world, SE3(), {1, 0.1}, &random);
  observations.resize(300);
  const SE3 initial = Perturbed(SE3(), 0.05, 0.02, &random);
  for (auto _ : state)
    benchmark::DoNotOptimize(OptimisePose(world.pinhole, observations, initial, {}));
}
BENCHMARK(MotionOnly)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace deepuav
