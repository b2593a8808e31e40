#pragma once

#include "deepuav/map/gauge.h"
#include "deepuav/map/map.h"
#include "deepuav/system/watching/run_observer.h"
#include "deepuav/viewer/view_state.h"

namespace deepuav {

/// Of a map what is shown, thinned out evenly: what was there once `newest` was its newest
/// keyframe, at the places where it is now. Without the path. `gauge`: of its world.
MapView ViewOf(const Map& map, GaugeKind gauge, KeyframeId newest);

/// All of it.
MapView ViewOf(const Map& map, GaugeKind gauge);
MapView ViewOf(const MapSketch& sketch);

}  // namespace deepuav
