#pragma once

#include <functional>
#include <vector>

#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "deepuav/estimation/bundle/model_noise.h"
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

/// The same of these landmarks, in the order of their ids, alone.
BundleWindow MakeBundleWindow(const Map& map, const std::vector<KeyframeId>& free,
                              std::vector<LandmarkId> landmarks, const Pinhole& pinhole);

/// All that these keyframes see, in the order of their ids.
std::vector<LandmarkId> LandmarksSeenBy(const Map& map, const std::vector<KeyframeId>& keyframes);

/// Takes the window's poses and landmarks over into the map.
void WriteBack(const BundleWindow& window, Map* map);
void RemoveOutliers(const BundleReport& report, const BundleWindow& window, Map* map);

/// Renews what the map knows of errors beyond those of the measurements, from all observations of
/// what these keyframes see, after an adjustment.
void UpdateModelSigma(Map* map, const std::vector<KeyframeId>& keyframes, const Pinhole& pinhole,
                      const ModelNoiseOptions& options);

}  // namespace deepuav
