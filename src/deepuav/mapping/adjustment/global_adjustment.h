#pragma once

#include <functional>

#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "deepuav/mapping/adjustment/bundle_window.h"

namespace deepuav {

/// Bundle adjustment of a whole map on a copy, while the map goes on growing. Make it, Compute() in
/// any thread, then Apply(). Thread-compatible.
class GlobalAdjustment {
 public:
  GlobalAdjustment(const Map& map, const Pinhole& pinhole, const BundleOptions& options);

  MapId map() const { return map_; }

  /// `stop`, if given, is asked between the steps.
  void Compute(const std::function<bool()>& stop = nullptr);

  /// Gives the map the poses and positions that the copy has now, and takes the observations from
  /// it that do not fit these. What was made meanwhile goes with its nearest ancestor in the
  /// spanning tree (keyframes), or with the keyframe of its representative (landmarks).
  void Apply(Map* map) const;

 private:
  /// Of all that the map observed, what does not fit the adjusted copy.
  void FindOutliersAmong(const std::vector<BundleObservation>& observations);

  const MapId map_;
  const BundleOptions options_;
  BundleWindow window_;
  std::vector<BundleObservation> outliers_;
};

}  // namespace deepuav
