#pragma once

#include "deepuav/map/map.h"
#include "deepuav/system/run_observer.h"
#include "deepuav/viewer/view_state.h"

namespace deepuav {

/// Of a map what is shown, thinned out evenly: what was there once `newest` was its newest
/// keyframe, at the places where it is now. Without the path.
MapView ViewOf(const Map& map, KeyframeId newest);

/// All of it.
MapView ViewOf(const Map& map);
MapView ViewOf(const MapSketch& sketch);

}  // namespace deepuav
