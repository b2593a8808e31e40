#pragma once

#include "deepuav/geometry/geo_point.h"

namespace deepuav {

/// What a map's world means.
enum class GaugeKind {
  kFree,           ///< Of the camera alone: place, heading and scale are arbitrary.
  kMetric,         ///< Metres, z up; place and heading are arbitrary.
  kGeoreferenced,  ///< Metres east, north and up of `origin`.
};

/// As summaries call it.
constexpr const char* GaugeName(GaugeKind kind) {
  switch (kind) {
    case GaugeKind::kFree:
      break;
    case GaugeKind::kMetric:
      return "metric";
    case GaugeKind::kGeoreferenced:
      return "georeferenced";
  }
  return "free";
}

struct Gauge {
  GaugeKind kind = GaugeKind::kFree;
  GeoPoint origin;         ///< Of georeferenced maps alone.
  double scale_sigma = 0;  ///< Standard deviation of the scale, as a share of it.
};

}  // namespace deepuav
