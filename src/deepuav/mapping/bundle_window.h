#pragma once

#include <functional>
#include <vector>

#include "deepuav/estimation/bundle_adjustment.h"
#include "deepuav/estimation/model_noise.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// A bundle problem and what its indices mean in the map.
struct BundleWindow {
  BundleProblem problem;
  std::vector<KeyframeId> keyframes;
  std::vector<LandmarkId> landmarks;
};

/// The problem of adjusting the poses of `free` keyframes and all landmarks they see; other
/// keyframes that see these landmarks, and the root, are fixed.
BundleWindow MakeBundleWindow(const Map& map, const std::vector<KeyframeId>& free,
                              const Pinhole& pinhole);

/// Adjusts the poses of `free` keyframes and all landmarks they see; other keyframes that see these
/// landmarks hold still and anchor them. Writes the result into the map and removes the
/// observations found to be outliers. Returns the report of the second of two runs: outliers of the
/// first are left out of it.
BundleReport AdjustWindow(Map* map, const std::vector<KeyframeId>& free, const Pinhole& pinhole,
                          const BundleOptions& options,
                          const std::function<bool()>& stop = nullptr);

struct MapFactors;

/// The same for all keyframes of a map; where the options ask for it, `pinhole` is refined too.
/// `factors`, if given, are what other sensors say of the keyframes.
BundleReport AdjustMap(Map* map, Pinhole* pinhole, const BundleOptions& options,
                       const std::function<bool()>& stop = nullptr,
                       const MapFactors* factors = nullptr);

/// Renews what the map knows of errors beyond those of the measurements, from all observations of
/// what these keyframes see, after an adjustment.
void UpdateModelSigma(Map* map, const std::vector<KeyframeId>& keyframes, const Pinhole& pinhole,
                      const ModelNoiseOptions& options);

}  // namespace deepuav
