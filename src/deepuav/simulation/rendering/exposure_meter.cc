#include "deepuav/simulation/rendering/exposure_meter.h"

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "deepuav/simulation/rendering/camera_pose.h"
#include "deepuav/simulation/rendering/light_tracer.h"

namespace deepuav {

ExposureSetting ExposureMeter::Meter(const PathOfCamera& path, double time_s) const {
  constexpr int kProbeStepPx = 24, kMoments = 6;
  constexpr double kMomentLags = 0.5;
  const double lag_s = sensor_.exposure_lag_s;
  const LightTracer tracer(world_, sky_, nullptr);
  double weighted = 0, weights = 0;
  for (int k = 0; k < (lag_s > 0 ? kMoments : 1); ++k) {
    const CameraPose pose(path(time_s - k * kMomentLags * lag_s));
    std::vector<float> radiances;
    for (int y = kProbeStepPx / 2; y < camera_.height; y += kProbeStepPx) {
      for (int x = kProbeStepPx / 2; x < camera_.width; x += kProbeStepPx * RayPacket::kSize) {
        RayPacket packet;
        for (int i = 0; i < RayPacket::kSize; ++i) {
          const int column = x + i * kProbeStepPx;
          if (column >= camera_.width) break;
          const Eigen::Vector2f ray = rays_.At(column, y);
          if (std::isnan(ray.x())) continue;
          packet.Set(i, pose.position, pose.rotation * Eigen::Vector3f(ray.x(), ray.y(), 1), 0);
        }
        const auto light = tracer.Radiance(&packet, kProbeStepPx * rays_.pixel_size());
        for (int i = 0; i < RayPacket::kSize; ++i) {
          if (packet.valid[static_cast<size_t>(i)] != 0)
            radiances.push_back(light[static_cast<size_t>(i)]);
        }
      }
    }
    const double weight = std::exp(-k * kMomentLags);
    weighted += weight * std::log(MeteredScale(sensor_, radiances));
    weights += weight;
  }
  return SettingFor(sensor_, std::exp(weighted / weights));
}

}  // namespace deepuav
