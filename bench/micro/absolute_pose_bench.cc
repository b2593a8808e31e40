// Locating a camera by matches of which many are wrong: ours against OpenCV's USAC.

#include <benchmark/benchmark.h>

#include <opencv2/calib3d.hpp>

#include "deepuav/estimation/poses/absolute_pose.h"
#include "deepuav/estimation/poses/p3p.h"
#include "deepuav/estimation/two_views/usac.h"
#include "support/estimation_problems.h"

namespace deepuav {
namespace {

constexpr int kMaxIterations = 500;
constexpr int kMatches = 100;

struct Problem {
  Pinhole pinhole;
  SE3 truth;
  std::vector<PoseObservation> observations;
};

/// Range 0: percent of the matches that are wrong.
Problem MakeProblem(const benchmark::State& state) {
  Random random(1);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(600, {-6, -4, 4}, {6, 4, 15}, &random);
  Problem problem{world.pinhole, Perturbed(SE3(), 2, 0.2, &random), {}};
  problem.observations =
      ObservePose(world, problem.truth, {1, 0.01 * static_cast<double>(state.range(0))}, &random);
  problem.observations.resize(std::min<size_t>(kMatches, problem.observations.size()));
  return problem;
}

/// What share of the searches found the pose, by its centre.
void CountFound(benchmark::State& state, int found) {
  state.counters["found"] = static_cast<double>(found) / static_cast<double>(state.iterations());
}

bool IsNear(const SE3& pose, const SE3& truth) {
  return (pose.InverseTranslation() - truth.InverseTranslation()).norm() < 0.2;
}

void WrongShares(benchmark::internal::Benchmark* bench) {
  bench->ArgName("wrong_percent")->Unit(benchmark::kMicrosecond);
  for (int percent : {20, 60, 80, 100}) bench->Arg(percent);
}

void Ours(benchmark::State& state) {
  const Problem problem = MakeProblem(state);
  AbsolutePoseOptions options;
  options.max_iterations = kMaxIterations;
  uint64_t seed = 0;
  int found = 0;
  for (auto _ : state) {
    const auto pose = EstimateAbsolutePose(problem.pinhole, problem.observations, ++seed, options);
    found += pose && IsNear(pose->cam_from_world, problem.truth);
  }
  CountFound(state, found);
}
BENCHMARK(Ours)->Apply(WrongShares);

void OpenCvUsac(benchmark::State& state) {
  const Problem problem = MakeProblem(state);
  std::vector<cv::Point3d> landmarks;
  std::vector<cv::Point2d> rays;
  for (const PoseObservation& observation : problem.observations) {
    const Eigen::Vector3d& p = observation.landmark_world;
    const Eigen::Vector3d ray = problem.pinhole.Unproject(observation.px);
    landmarks.emplace_back(p.x(), p.y(), p.z());
    rays.emplace_back(ray.x(), ray.y());
  }
  const double threshold = AbsolutePoseOptions().max_error_px / problem.pinhole.fx;
  uint64_t seed = 0;
  int found = 0;
  for (auto _ : state) {
    const cv::UsacParams params =
        MakeUsacParams(threshold, AbsolutePoseOptions().confidence, kMaxIterations, ++seed);
    cv::Mat camera = cv::Mat::eye(3, 3, CV_64F), rotation, translation, inliers;
    if (!cv::solvePnPRansac(landmarks, rays, camera, cv::noArray(), rotation, translation, inliers,
                            params)) {
      continue;
    }
    found += IsNear(SE3(RotationExp(Eigen::Vector3d(rotation.ptr<double>())),
                        Eigen::Vector3d(translation.ptr<double>())),
                    problem.truth);
  }
  CountFound(state, found);
}
BENCHMARK(OpenCvUsac)->Apply(WrongShares);

void SolutionsOfThreePoints(benchmark::State& state) {
  Random random(1);
  std::array<Eigen::Vector3d, 3> points, rays;
  for (size_t i = 0; i < 3; ++i) {
    points[i] = {random.Uniform(-3, 3), random.Uniform(-2, 2), random.Uniform(4, 9)};
    rays[i] = points[i].normalized();
  }
  for (auto _ : state) benchmark::DoNotOptimize(SolveP3P(points, rays));
}
BENCHMARK(SolutionsOfThreePoints);

}  // namespace
}  // namespace deepuav
