#pragma once

#include <functional>
#include <map>
#include <optional>

#include "deepuav/map/atlas.h"
#include "deepuav/mapping/adjustment/keyframe_covariances.h"
#include "deepuav/system/frames/frame_record.h"
#include "deepuav/system/sensors/georeferencing.h"

namespace deepuav {

using MapCovariances = std::map<MapId, KeyframeCovariances>;

/// Of the keyframes of all maps as they are at the end of a run. Where `fixes` placed a map on
/// Earth they count; where its gauge is metric its scale is as uncertain as that says.
MapCovariances EstimateMapCovariances(const Atlas& atlas, const Pinhole& pinhole,
                                      const BundleOptions& options,
                                      const std::map<MapId, GeoreferenceReport>& fixes,
                                      const std::function<bool()>& stop);

/// The covariance of a frame's position, in the world's axes and the map's units, and orientation,
/// as a turn about the world's axes in radians: its keyframe's, and what its own pixels leave open
/// beside it. Nothing for frames without a pose, with one that no pixel told, or in a map without
/// covariances.
std::optional<Matrix6d> PoseCovariance(const FrameRecord& record, const Atlas& atlas,
                                       const MapCovariances& covariances);

}  // namespace deepuav
