#include "deepuav/simulation/rendering/view_from_above.h"

#include <algorithm>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/simulation/rendering/light_tracer.h"
#include "deepuav/simulation/rendering/parallel_rows.h"
#include "deepuav/simulation/rendering/sky.h"

namespace deepuav {
namespace {

// Above all that stands, and low enough that haze does not count.
constexpr float kFrom_m = 400;
// Rays a cell, in a square.
constexpr int kSide = 2;

}  // namespace

ViewFromAbove LookDown(const World& world, const RenderOptions& options, const cv::Size& size,
                       double cell_m,
                       const std::function<Eigen::Vector2d(double column, double row)>& place_of) {
  if (world.CeilingHeight()) throw Error("a hall has a roof: expected a scene without one");
  options.Check();
  const Sky sky(options.weather, world.geometry().textures());
  const LightTracer tracer(world.geometry(), sky, nullptr);
  const float pixel_size = static_cast<float>(cell_m) / kSide / kFrom_m;
  ViewFromAbove view{cv::Mat1f::zeros(size),
                     cv::Mat1f(size, std::numeric_limits<float>::quiet_NaN())};
  const auto trace = [&](int row, int first, double x_offset, double y_offset) {
    const int count = std::min(RayPacket::kSize, size.width - first);
    RayPacket packet;
    for (int lane = 0; lane < count; ++lane) {
      const Eigen::Vector2f place = place_of(first + lane + x_offset, row + y_offset).cast<float>();
      packet.Set(lane, {place.x(), place.y(), kFrom_m}, {0, 0, -1}, 0);
    }
    const auto light = tracer.Radiance(&packet, pixel_size);
    for (int lane = 0; lane < count; ++lane) {
      view.radiance(row, first + lane) += light[static_cast<size_t>(lane)] / (kSide * kSide);
      if (packet.Hits(lane)) view.height_m(row, first + lane) = kFrom_m - packet.Depth(lane);
    }
  };
  ForRowsInParallel(size.height, options.threads, [&](int begin, int end) {
    for (int row = begin; row < end; ++row) {
      for (int first = 0; first < size.width; first += RayPacket::kSize) {
        for (int i = 0; i < kSide * kSide; ++i)
          trace(row, first, (i % kSide + 0.5) / kSide - 0.5, (i / kSide + 0.5) / kSide - 0.5);
      }
    }
  });
  return view;
}

}  // namespace deepuav
