#pragma once

#include "deepuav/geometry/geo_point.h"

namespace deepuav {

/// What a map's world means.
enum class GaugeKind {
  kFree,           ///< Of the camera alone: place, heading and scale are arbitrary.
  kGeoreferenced,  ///< Metres east, north and up of `origin`.
};

struct Gauge {
  GaugeKind kind = GaugeKind::kFree;
  GeoPoint origin;
  double scale_sigma = 0;  ///< Standard deviation of the scale, as a share of it.
};

}  // namespace deepuav
