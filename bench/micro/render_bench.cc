#include <benchmark/benchmark.h>

#include <Eigen/Geometry>
#include <cmath>

#include "deepuav/simulation/camera_rays.h"
#include "deepuav/simulation/light_tracer.h"
#include "deepuav/simulation/renderer.h"

// How fast pictures are rendered, and how fast Embree alone answers the same first rays.

namespace deepuav {
namespace {

Camera EurocCamera() {
  Camera camera;
  camera.width = 752;
  camera.height = 480;
  camera.pinhole = {458.654, 457.296, 367.215, 248.375};
  camera.lens = LensModel::kRadialTangential;
  camera.distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  return camera;
}

const World& Village() {
  static const World world(LoadScene("village"));
  return world;
}

// Over the middle of the village, looking down at 40 degrees.
SE3 Pose(double height_m) {
  const double down = 40 * M_PI / 180;
  const Eigen::Vector3d forward(std::cos(down), 0, -std::sin(down)), right(0, -1, 0);
  Eigen::Matrix3d rotation;
  rotation << right, forward.cross(right), forward;
  return {rotation, {-60, 10, Village().GroundHeight(-60, 10) + height_m}};
}

void Picture(benchmark::State& state) {
  RenderOptions options;
  options.threads = static_cast<int>(state.range(1));
  Renderer renderer(Village(), EurocCamera(), options);
  const SE3 pose = Pose(static_cast<double>(state.range(0)));
  int frame = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(renderer.Render([&](double) { return pose; }, 0, frame++).image.data);
  }
  state.counters["frames/s"] = benchmark::Counter(frame, benchmark::Counter::kIsRate);
}
BENCHMARK(Picture)
    ->ArgNames({"height", "threads"})
    ->ArgsProduct({{10, 40, 150}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

// One thread: first rays, then shadow rays and shading too.
void Rays(benchmark::State& state, bool shade) {
  const Camera camera = EurocCamera();
  const CameraRays rays(camera, 0);
  const WorldGeometry& world = Village().geometry();
  const Sky sky(WeatherOptions(), world.textures());
  const LightTracer tracer(world, sky, nullptr);
  const SE3 pose = Pose(40);
  const Eigen::Matrix3f rotation = pose.RotationMatrix().cast<float>();
  const Eigen::Vector3f position = pose.translation().cast<float>();
  for (auto _ : state) {
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; x += RayPacket::kSize) {
        RayPacket packet;
        for (int i = 0; i < RayPacket::kSize; ++i) {
          packet.Set(i, position, rotation * rays.At(x + i, y).homogeneous(), 0);
        }
        if (shade) {
          benchmark::DoNotOptimize(tracer.Radiance(&packet, rays.pixel_size()));
        } else {
          tracer.Intersect(&packet);
          benchmark::DoNotOptimize(packet);
        }
      }
    }
  }
  const double count = static_cast<double>(camera.width) * camera.height;
  state.counters["pixels/s"] =
      benchmark::Counter(count, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK_CAPTURE(Rays, IntersectAlone, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Rays, WithShadowsAndShading, true)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace deepuav
