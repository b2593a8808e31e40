#pragma once

#include <vector>

#include "deepuav/map/map.h"
#include "deepuav/mapping/adjustment/map_factors.h"
#include "deepuav/sensors/georeference.h"

namespace deepuav {

/// Over the common standard deviation: from here on fixes and what is known beside contradict each
/// other.
inline constexpr double kContradictionSigmas = 4;
/// What a path is known by of which no more is known than which way is about up.
inline constexpr MetricPrior kRoughlyUp{1e3, 1e3};

/// How far the fixes alone would move what is known of a map whose world it is in, by an inertial
/// sensor or by attitudes, over the common standard deviation.
double Contradiction(const Georeference& by_fixes, const MetricPrior& known);
double Contradiction(const Georeference& by_fixes, const OrientationPrior& known);

/// Factors of keyframes, at least one, by growing time, each so weak that all together say what is
/// known of the map as it lies now: that it keeps its scale and level where an inertial sensor told
/// them, else that what attitudes say is level is level, else that the cameras' x axes are, with
/// `level_sigma_rad`; and that what attitudes say is north is.
MapFactors FactorsOf(const PlacePriors& known, const Map& map,
                     const std::vector<KeyframeId>& keyframes, double level_sigma_rad);

}  // namespace deepuav
