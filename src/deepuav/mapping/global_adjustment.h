#pragma once

#include <functional>

#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "deepuav/mapping/bundle_window.h"

namespace deepuav {

/// Bundle adjustment of a whole map on a copy, while the map goes on growing. Make it, Compute() in
/// any thread, then Apply(). Thread-compatible.
class GlobalAdjustment {
 public:
  GlobalAdjustment(const Map& map, const Pinhole& pinhole, const BundleOptions& options);

  MapId map() const { return map_; }

  /// `stop`, if given, is asked between the steps.
  void Compute(const std::function<bool()>& stop = nullptr);

  /// Gives the map the poses and positions that the copy has now. What was made meanwhile goes with
  /// its nearest ancestor in the spanning tree (keyframes), or with the keyframe of its
  /// representative (landmarks).
  void Apply(Map* map) const;

 private:
  const MapId map_;
  const BundleOptions options_;
  BundleWindow window_;
};

}  // namespace deepuav
