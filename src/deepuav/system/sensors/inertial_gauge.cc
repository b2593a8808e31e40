#include "deepuav/system/sensors/inertial_gauge.h"

#include <cmath>
#include <utility>

#include "deepuav/base/logging.h"

namespace deepuav {

InertialGauge::InertialGauge(const ImuStream& imu, const InertialOptions& options,
                             PoseOfFrame pose_of_frame, Mapper* mapper, Atlas* atlas)
    : imu_(imu),
      options_(options),
      pose_of_frame_(std::move(pose_of_frame)),
      mapper_(mapper),
      atlas_(atlas) {}

InertialAttempt InertialGauge::Apply(MapId map, const std::vector<FrameRecord>& records,
                                     const std::function<bool()>& stop) {
  InertialAttempt attempt =
      AlignInertially(PathIn(*atlas_, map, records, pose_of_frame_), imu_, options_, stop);
  if (attempt.found) {
    mapper_->ChangeGauge(map, attempt.found->level_from_world,
                         {GaugeKind::kMetric, {}, attempt.found->scale_sigma});
  }
  return attempt;
}

std::map<MapId, InertialAttempt> InertialGauge::ApplyToAll(const std::vector<MapId>& maps,
                                                           const std::vector<FrameRecord>& records,
                                                           const std::function<bool()>& stop) {
  std::map<MapId, InertialAttempt> attempts;
  for (const MapId map : maps) {
    if (stop && stop()) break;
    if (atlas_->GaugeOf(map).kind != GaugeKind::kFree) continue;
    const InertialAttempt& attempt = attempts[map] = Apply(map, records, stop);
    if (attempt.found) {
      Log().info("map {} is in metres, to {:.1f} %, and level, to {:.2f} degrees, by its IMU",
                 map.value, 100 * attempt.found->scale_sigma,
                 attempt.found->tilt_sigma_rad * 180 / M_PI);
      if (!imu_.mount_is_known) {
        Log().info("how the IMU is mounted is told by the camera's turns, to {:.2f} degrees",
                   attempt.found->mount_sigma_rad * 180 / M_PI);
      }
    } else {
      Log().warn("map {} is not in metres by its IMU: {}", map.value, attempt.reason);
    }
  }
  return attempts;
}

}  // namespace deepuav
