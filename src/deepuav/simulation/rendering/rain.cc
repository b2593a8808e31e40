#include "deepuav/simulation/rendering/rain.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kBoxM = 4;           // Drops repeat in cubes of this size.
constexpr double kDropsPerMmH = 640;  // In such a cube, large enough to be seen.
constexpr double kNearestM = 0.25;
constexpr double kDropM = 0.003;
constexpr double kStepPx = 0.5;
constexpr float kMostOpaque = 0.75f;

struct Drop {
  Vector3d start;  // At time 0.
  double speed_m_s, size_m;
};

Drop MakeDrop(Random* random) {
  Drop drop;
  drop.start = {random->Uniform(0, kBoxM), random->Uniform(0, kBoxM), random->Uniform(0, kBoxM)};
  const double size = random->Uniform(0.5, 1.5);
  drop.size_m = kDropM * size;
  drop.speed_m_s = 7.5 * std::sqrt(size);
  return drop;
}

// The copy of a periodic point that is nearest to `centre`.
Vector3d NearestCopy(const Vector3d& point, const Vector3d& centre) {
  Vector3d offset = (point - centre) / kBoxM;
  offset.array() -= (offset.array() + 0.5).floor();
  return centre + kBoxM * offset;
}

void AddWeight(const Vector2d& pixel, float weight, cv::Mat1f* opacity) {
  const int x = static_cast<int>(std::floor(pixel.x())),
            y = static_cast<int>(std::floor(pixel.y()));
  const auto fx = static_cast<float>(pixel.x() - x), fy = static_cast<float>(pixel.y() - y);
  const auto add = [&](int column, int row, float share) {
    if (column < 0 || row < 0 || column >= opacity->cols || row >= opacity->rows) return;
    (*opacity)(row, column) += weight * share;
  };
  add(x, y, (1 - fx) * (1 - fy));
  add(x + 1, y, fx * (1 - fy));
  add(x, y + 1, (1 - fx) * fy);
  add(x + 1, y + 1, fx * fy);
}

// The drop's area is spread over the streak.
void DrawStreak(const Vector2d& from, const Vector2d& to, double size_px, cv::Mat1f* opacity) {
  const double length = (to - from).norm();
  constexpr double kLongestPx = 2000;
  if (!(length < kLongestPx)) return;
  const int steps = 1 + static_cast<int>(std::ceil(length / kStepPx));
  const int tracks = std::max(1, static_cast<int>(std::lround(size_px / 0.7)));
  const Vector2d across = length > 1e-9
                              ? Vector2d(-(to - from).y() / length, (to - from).x() / length)
                              : Vector2d(1, 0);
  const double area =
      size_px * std::max(size_px, length + size_px) * (size_px / (length + size_px));
  const auto weight = static_cast<float>(area / (steps * tracks));
  for (int track = 0; track < tracks; ++track) {
    const double side = ((track + 0.5) / tracks - 0.5) * size_px;
    for (int i = 0; i < steps; ++i) {
      const double along = steps > 1 ? static_cast<double>(i) / (steps - 1) : 0.5;
      AddWeight(from + along * (to - from) + side * across, weight, opacity);
    }
  }
}

}  // namespace

void DrawRain(const WeatherOptions& weather, const Camera& camera, const RainView& view,
              uint64_t seed, cv::Mat1f* radiance) {
  if (weather.rain_mm_h <= 0) return;
  Random random(seed);
  const SE3 start = view.world_from_cam_start.Inverse(), end = view.world_from_cam_end.Inverse();
  const double focal = std::sqrt(camera.pinhole.fx * camera.pinhole.fy);
  const int count = static_cast<int>(kDropsPerMmH * weather.rain_mm_h);
  cv::Mat1f opacity = cv::Mat1f::zeros(radiance->size());
  for (int i = 0; i < count; ++i) {
    const Drop drop = MakeDrop(&random);
    const Vector3d velocity(weather.wind_m_s, 0, -drop.speed_m_s);
    const Vector3d point =
        NearestCopy(drop.start + view.start_s * velocity, view.world_from_cam_start.translation());
    const Vector3d from = start * point;
    const Vector3d to = end * (point + (view.end_s - view.start_s) * velocity);
    if (from.z() < kNearestM || to.z() < kNearestM || from.norm() > kBoxM / 2) continue;
    const auto from_px = camera.Distort(from), to_px = camera.Distort(to);
    if (!from_px || !to_px) continue;
    DrawStreak(*from_px, *to_px, focal * drop.size_m / from.z(), &opacity);
  }
  for (int y = 0; y < radiance->rows; ++y) {
    for (int x = 0; x < radiance->cols; ++x) {
      const float share = std::min(opacity(y, x), kMostOpaque);
      float& value = (*radiance)(y, x);
      value += share * (view.drop_radiance - value);
    }
  }
}

}  // namespace deepuav
