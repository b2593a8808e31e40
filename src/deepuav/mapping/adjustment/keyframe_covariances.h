#pragma once

#include <map>

#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "deepuav/map/map.h"

namespace deepuav {

struct MapFactors;

/// The covariance of each keyframe's cam_from_world, as a twist [translation; rotation] from the
/// left.
using KeyframeCovariances = std::map<KeyframeId, Matrix6d>;

/// What all that the map holds tells of the poses of its keyframes, drift included, the lens taken
/// as known. With measured positions among the `factors`, in the world. Without, relative to the
/// root, whose own pose is exact by definition; the scale is then known to `scale_sigma` (as a
/// share of it), and where that is 0 the distance from the root to the farthest keyframe is the
/// unit. Empty where the map does not tell them.
KeyframeCovariances EstimateKeyframeCovariances(const Map& map, const Pinhole& pinhole,
                                                const BundleOptions& options,
                                                const MapFactors* factors, double scale_sigma);

}  // namespace deepuav
