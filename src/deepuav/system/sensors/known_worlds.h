#pragma once

#include <deque>
#include <optional>

#include "deepuav/system/sensors/metric_from_map.h"
#include "deepuav/system/watching/run_observer.h"

namespace deepuav {

/// What is known of maps' metres, and of their place on Earth, from which revision of them on.
/// Thread-compatible.
class KnownWorlds {
 public:
  /// From this revision of the map on; nothing: it has no scale. Where the map had metres before,
  /// it keeps its heading and the point that is the origin: who finds them knows scale and level. A
  /// place on Earth is not given up for metres alone.
  void Use(MapId map, int64_t revision, const std::optional<MetricFromMap>& metric);
  /// What is known of a map goes over into the one that it becomes part of.
  void OnMap(const MapEvent& event);
  void OnGauge(MapId map, int64_t revision, const Gauge& gauge);
  std::optional<MetricFromMap> In(MapId map, int64_t revision) const;

 private:
  struct Since {
    MapId map;
    int64_t revision = 0;
    std::optional<MetricFromMap> metric;
  };
  void Keep(Since since);

  std::deque<Since> known_;  ///< The newest last.
};

}  // namespace deepuav
