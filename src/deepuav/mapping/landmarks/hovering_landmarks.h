#pragma once

#include <set>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// What tells a landmark that hovers between the camera and the ground below it.
struct HoveringOptions {
  bool distrust = true;
  double min_plane_share = 0.7;  ///< Of a view's landmarks that must lie on one plane.
  double max_plane_error = 0.3;  ///< Logarithm of a depth over the plane's.
  double max_depth_share = 0.5;  ///< Of the plane's depth behind it, of what hovers.
  int min_landmarks = 40;        ///< Fewer show no plane.
  int samples = 100;             ///< Planes tried.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("distrust", distrust, "",
          "have no poses held by landmarks that hover far above the ground, when all is adjusted");
    visit("min_plane_share", min_plane_share, "",
          "share of a view's landmarks on one plane from which others hover above it",
          Between(0, 1));
    visit("max_plane_error", max_plane_error, "",
          "logarithm of a landmark's depth over that of the plane it lies on", Above(0, 10));
    visit("max_depth_share", max_depth_share, "",
          "depth of what hovers over that of the plane behind it", Between(0, 1));
    visit("min_landmarks", min_landmarks, "", "landmarks of a view that can show a plane",
          Between(4, 100'000));
    visit("samples", samples, "", "planes tried in each view", Between(1, 10'000));
  }
};

/// The landmarks that hover in most of these views that see them: where most of a view lies on one
/// plane, and they at half the distance of it or less. Something that moves against the camera's
/// motion seems to stand so near, and tells a false motion there with a lever of that nearness,
/// although hardly a view contradicts it. At most half of what a keyframe sees.
std::set<LandmarkId> HoveringLandmarks(const Map& map, const std::vector<KeyframeId>& views,
                                       const HoveringOptions& options);

}  // namespace deepuav
