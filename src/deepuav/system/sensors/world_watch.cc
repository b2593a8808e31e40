#include "deepuav/system/sensors/world_watch.h"

#include <utility>

namespace deepuav {

WorldWatch::WorldWatch(std::optional<ImuStream> imu, std::optional<GnssStream> gnss,
                       const SensorUseOptions& options, const Tell& tell) {
  if (gnss) {
    place_ = std::make_unique<PlaceWatch>(
        std::move(*gnss), options, [tell](MapId map, int64_t revision, const PlacedWorld& world) {
          tell(map, revision,
               {world.local_from_world, world.scale_sigma(), world.origin, world.covariance});
        });
  }
  if (imu) {
    metric_ = std::make_unique<MetricWatch>(
        std::move(*imu), options.imu,
        [tell, place = place_.get()](MapId map, int64_t revision, const MetricWorld& world) {
          if (place) place->UseMetric(map, revision, world);
          tell(map, revision, {world.metric_from_world, world.scale_sigma, {}});
        });
  }
}

void WorldWatch::OnFrame(const FrameRecord& record, const Frame& frame) {
  if (metric_) metric_->OnFrame(record, frame);
  if (place_) place_->OnFrame(record, frame);
}

void WorldWatch::OnGauge(MapId map, int64_t revision, const Gauge& gauge) {
  if (metric_) metric_->OnGauge(map, revision, gauge);
  if (place_) place_->OnGauge(map, revision, gauge);
}

void WorldWatch::OnMapState(const Map& map) {
  if (place_) place_->OnMapState(map);
}

}  // namespace deepuav
