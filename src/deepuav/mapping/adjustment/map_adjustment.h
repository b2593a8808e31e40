#pragma once

#include <functional>
#include <vector>

#include "deepuav/estimation/bundle/reweighed_adjustment.h"
#include "deepuav/map/map.h"
#include "deepuav/mapping/landmarks/hovering_landmarks.h"

namespace deepuav {

struct MapFactors;

/// How far landmarks are trusted when a map is adjusted.
struct MapTrust {
  HoveringOptions hovering;
  ReweighingOptions reweighing;
};

/// All are, as their errors are stated.
MapTrust TrustInAll();

/// Adjusts the poses of `free` keyframes and all landmarks they see; other keyframes that see these
/// landmarks hold still and anchor them. First as errors are stated, then, without the outliers
/// found, as they show themselves. What hovers holds no poses: it is placed by them afterwards.
/// Writes the result into the map and removes the observations found to be outliers. Returns the
/// report of the second of the two runs.
BundleReport AdjustWindow(Map* map, const std::vector<KeyframeId>& free, const Pinhole& pinhole,
                          const BundleOptions& options, const MapTrust& trust,
                          const std::function<bool()>& stop = nullptr);

/// The same for all keyframes of a map; where the options ask for it, `pinhole` is refined too.
/// `factors`, if given, are what other sensors say of the keyframes.
BundleReport AdjustMap(Map* map, Pinhole* pinhole, const BundleOptions& options,
                       const MapTrust& trust, const std::function<bool()>& stop = nullptr,
                       const MapFactors* factors = nullptr);

}  // namespace deepuav
