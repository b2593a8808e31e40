#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "deepuav/system/sensors/metric_from_map.h"
#include "deepuav/system/sensors/metric_watch.h"
#include "deepuav/system/sensors/place_watch.h"

namespace deepuav {

/// Finds, beside a run and without changing it, which metres an inertial sensor and which place on
/// Earth position fixes give the map that the camera is in: a MetricWatch and a PlaceWatch.
/// Thread-safe as these.
class WorldWatch : public RunObserver {
 public:
  /// Told in threads of its own, one at a time each: from this revision of the map on.
  using Tell = std::function<void(MapId map, int64_t revision, const MetricFromMap& metric)>;

  /// The sensors that there are, with all that they measure or what is there already.
  WorldWatch(std::optional<ImuStream> imu, std::optional<GnssStream> gnss,
             const SensorUseOptions& options, const Tell& tell);

  /// Of sensors that there are, as they come.
  void AddSample(const ImuSample& sample) { metric_->AddSample(sample); }
  void AddFix(const GnssFix& fix) { place_->AddFix(fix); }
  /// As PlaceWatch::UseOrigin.
  void UseOrigin(const GeoPoint& origin) { place_->UseOrigin(origin); }

  void OnFrame(const FrameRecord& record, const Frame& frame) override;
  void OnKeyframe(KeyframeEvent /*event*/) override {}
  void OnMap(const MapEvent& /*event*/) override {}
  void OnGauge(MapId map, int64_t revision, const Gauge& gauge) override;
  void OnMapState(const Map& map) override;

 private:
  std::unique_ptr<PlaceWatch> place_;    ///< Null: there is no receiver.
  std::unique_ptr<MetricWatch> metric_;  ///< Null: no inertial sensor. Its thread uses the other.
};

}  // namespace deepuav
