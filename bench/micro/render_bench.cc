#include <benchmark/benchmark.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <vector>

#include "deepuav/simulation/rendering/camera_rays.h"
#include "deepuav/simulation/rendering/light_tracer.h"
#include "deepuav/simulation/rendering/renderer.h"

// How fast pictures are rendered, and how fast Embree alone answers the same rays, first and
// shadow.

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

// The shadow rays of a packet of first rays.
struct ShadowPacket {
  alignas(32) RTCRay8 rays{};
  alignas(32) std::array<int, RayPacket::kSize> valid{};

  void Set(int lane, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) {
    rays.org_x[lane] = origin.x();
    rays.org_y[lane] = origin.y();
    rays.org_z[lane] = origin.z();
    rays.dir_x[lane] = direction.x();
    rays.dir_y[lane] = direction.y();
    rays.dir_z[lane] = direction.z();
    rays.tfar[lane] = 20000;
    rays.mask[lane] = ~0u;
    valid[static_cast<size_t>(lane)] = -1;
  }
};

// The rays of a picture in tiles of 4 x 2 pixels, as the renderer has them.
struct PictureRays {
  std::vector<RayPacket> first;
  std::vector<ShadowPacket> shadow;
  double count = 0;  // Of both kinds.

  PictureRays(const LightTracer& tracer, const Sky& sky, const CameraRays& rays, const SE3& pose) {
    const Eigen::Matrix3f rotation = pose.RotationMatrix().cast<float>();
    const Eigen::Vector3f position = pose.translation().cast<float>();
    for (int y = 0; y < rays.height(); y += 2) {
      for (int x = 0; x < rays.width(); x += 4) {
        RayPacket packet;
        for (int i = 0; i < RayPacket::kSize; ++i)
          packet.Set(i, position, rotation * rays.At(x + i % 4, y + i / 4).homogeneous(), 0);
        first.push_back(packet);
        tracer.Intersect(&packet);
        AddShadows(tracer, sky, packet);
      }
    }
  }

 private:
  // From where the surface, seen from its lit side, faces the sun.
  void AddShadows(const LightTracer& tracer, const Sky& sky, const RayPacket& packet) {
    ShadowPacket& added = shadow.emplace_back();
    count += RayPacket::kSize;
    for (int i = 0; i < RayPacket::kSize; ++i) {
      if (!packet.Hits(i)) continue;
      const SurfacePoint point = tracer.PointAt(packet, i);
      Eigen::Vector3f normal = point.geometric_normal;
      if (normal.dot(packet.Direction(i)) > 0) normal = -normal;
      if (normal.dot(sky.sun_direction()) <= 0) continue;
      const float lift = 0.004f + 2e-4f * packet.Depth(i) * packet.Direction(i).norm();
      added.Set(i, point.position + lift * normal, sky.sun_direction());
      count += 1;
    }
  }
};

// One thread, the rays of a picture alone: traced by Embree and nothing else, or traced and shaded.
void Rays(benchmark::State& state, bool shade) {
  const CameraRays rays(EurocCamera(), 0);
  const WorldGeometry& world = Village().geometry();
  const Sky sky(WeatherOptions(), world.textures());
  const LightTracer tracer(world, sky, nullptr);
  const PictureRays picture(tracer, sky, rays, Pose(static_cast<double>(state.range(0))));
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  for (auto _ : state) {
    for (size_t i = 0; i < picture.first.size(); ++i) {
      RayPacket packet = picture.first[i];
      if (shade) {
        benchmark::DoNotOptimize(tracer.Radiance(&packet, rays.pixel_size()));
        continue;
      }
      rtcIntersect8(packet.valid.data(), world.static_scene(), &context, &packet.rays);
      ShadowPacket shadow = picture.shadow[i];
      rtcOccluded8(shadow.valid.data(), world.static_scene(), &context, &shadow.rays);
      benchmark::DoNotOptimize(packet);
      benchmark::DoNotOptimize(shadow);
    }
  }
  state.counters["rays/s"] =
      benchmark::Counter(picture.count, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK_CAPTURE(Rays, EmbreeAlone, false)
    ->ArgName("height")
    ->Arg(10)
    ->Arg(40)
    ->Arg(150)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Rays, WithShading, true)
    ->ArgName("height")
    ->Arg(10)
    ->Arg(40)
    ->Arg(150)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace deepuav
