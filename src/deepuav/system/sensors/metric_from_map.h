#pragma once

#include <Eigen/Core>
#include <optional>

#include "deepuav/geometry/geo_point.h"
#include "deepuav/geometry/sim3.h"
#include "deepuav/map/gauge.h"

namespace deepuav {

/// What makes metres, with z up, of a map's world.
struct MetricFromMap {
  Sim3 metric_from_map;
  double scale_sigma = 0;          ///< Standard deviation of the scale, as a share of it.
  std::optional<GeoPoint> origin;  ///< Where it is known: then metres are east, north and up of it.
  /// Of a turn and a shift from the left and of the logarithm of the scale, turn and scale about
  /// where the map's own origin lies. Without it the scale is uncertain about the metres' origin.
  std::optional<Eigen::Matrix<double, 7, 7>> covariance = {};
};

/// Nothing for a map without scale.
inline std::optional<MetricFromMap> MetricOf(const Gauge& gauge) {
  if (gauge.kind == GaugeKind::kFree) return std::nullopt;
  MetricFromMap metric;
  metric.scale_sigma = gauge.scale_sigma;
  if (gauge.kind == GaugeKind::kGeoreferenced) metric.origin = gauge.origin;
  return metric;
}

}  // namespace deepuav
