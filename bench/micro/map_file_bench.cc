#include <benchmark/benchmark.h>

#include <filesystem>
#include <memory>

#include "deepuav/base/random.h"
#include "deepuav/io/maps/map_file.h"

namespace deepuav {
namespace {

constexpr int kKeyframes = 500, kKeypoints = 1000, kDimension = 256;
constexpr int kViewsOfLandmark = 5;

std::shared_ptr<const Features> RandomFeatures(Random* random) {
  Features features{{}, Descriptors(kDimension)};
  std::vector<float> row(kDimension);
  for (int i = 0; i < kKeypoints; ++i) {
    const Eigen::Vector2f px(static_cast<float>(random->Uniform(0, 752)),
                             static_cast<float>(random->Uniform(0, 480)));
    features.keypoints.push_back({px, px, static_cast<float>(random->Uniform(0, 1)), 1});
    for (float& value : row) value = static_cast<float>(random->Gaussian(1.0 / 16));
    features.descriptors.Append(row);
  }
  return std::make_shared<const Features>(std::move(features));
}

/// Every key point shows a landmark, seen from a few keyframes in a row.
Atlas LargeAtlas() {
  Random random(1);
  Atlas atlas;
  Map& map = atlas.Add(Map(atlas.NextMap()));
  for (int i = 0; i < kKeyframes; ++i) {
    const Frame frame{FrameId{i}, Timestamp{50000000 * int64_t{i}}, RandomFeatures(&random)};
    const KeyframeId id = atlas.ids().NextKeyframe();
    map.AddKeyframe(id, frame, SE3());
    if (i > 0) map.ConnectToParent(id, KeyframeId{i - 1});
  }
  for (int i = 0; i < kKeyframes; i += kViewsOfLandmark) {
    for (int k = 0; k < kKeypoints; ++k) {
      const LandmarkId id = atlas.ids().NextLandmark();
      map.AddLandmark(id, {random.Gaussian(10), random.Gaussian(10), random.Gaussian(10)},
                      KeyframeId{i});
      for (int view = 0; view < kViewsOfLandmark; ++view) {
        map.AddObservation(KeyframeId{i + view}, k, id);
      }
    }
  }
  return atlas;
}

Camera BenchCamera() {
  Camera camera;
  camera.width = 752;
  camera.height = 480;
  camera.pinhole = {458.654, 457.296, 367.215, 248.375};
  return camera;
}

/// Saving and loading 500 keyframes of 1000 key points with 256-d descriptors.
class MapFileBench : public benchmark::Fixture {
 public:
  void SetUp(const benchmark::State&) override {
    atlas_ = LargeAtlas();
    file_ = std::filesystem::temp_directory_path() / "deepuav_map_file_bench.deepuav";
    WriteMapFile(file_, atlas_, BenchCamera(), {});
  }
  void TearDown(const benchmark::State&) override { std::filesystem::remove(file_); }

 protected:
  void CountBytes(benchmark::State* state) const {
    const auto bytes = static_cast<int64_t>(std::filesystem::file_size(file_));
    state->SetBytesProcessed(bytes * state->iterations());
    state->counters["file_mb"] = 1e-6 * static_cast<double>(bytes);
  }

  Atlas atlas_;
  std::filesystem::path file_;
};

BENCHMARK_DEFINE_F(MapFileBench, Write)(benchmark::State& state) {
  for (auto _ : state) WriteMapFile(file_, atlas_, BenchCamera(), {});
  CountBytes(&state);
}

BENCHMARK_DEFINE_F(MapFileBench, Read)(benchmark::State& state) {
  for (auto _ : state) {
    LoadedAtlas loaded = ReadMapFile(file_);
    benchmark::DoNotOptimize(loaded.atlas);
  }
  CountBytes(&state);
}

BENCHMARK_REGISTER_F(MapFileBench, Write)->Unit(benchmark::kMillisecond);
BENCHMARK_REGISTER_F(MapFileBench, Read)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace deepuav
