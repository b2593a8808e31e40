#pragma once

#include <string>

#include "deepuav/base/option_bounds.h"
#include "deepuav/looping/loop_verifier.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// How far a map can have drifted between two of its keyframes. Drift adds up as the view is
/// replaced by another, by travelling or by turning: the travel counts a turn as the way that
/// replaces as much.
struct DriftOptions {
  int min_shared = 15;       ///< Landmarks that keyframes share for the map to hold them together.
  double per_travel = 0.1;   ///< Of position over the travel, beyond what scale and turn explain.
  double least_scale = 0.2;  ///< Of scale (natural logarithm), however short the travel...
  double scale_per_view = 0.02;  ///< ...and more for each view travelled.
  double least_turn_deg = 10;    ///< Of direction, likewise.
  double turn_per_view_deg = 1.5;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("min_shared", min_shared, "",
          "landmarks that keyframes share for the map to hold them together",
          Between(1, 1'000'000));
    visit("per_travel", per_travel, "",
          "drift of position over the travel, at most, beyond what scale and turn explain",
          Above(0, 1e6));
    visit("least_scale", least_scale, "",
          "natural logarithm of the drift of scale that is possible at once", Above(0, 100));
    visit("scale_per_view", scale_per_view, "", "the same for each view travelled",
          Between(0, 100));
    visit("least_turn_deg", least_turn_deg, "deg", "drift of direction that is possible at once",
          Above(0, 360));
    visit("turn_per_view_deg", turn_per_view_deg, "deg", "the same for each view travelled",
          Between(0, 360));
  }
};

/// The shortest way from keyframe `from` to `to` through keyframes that the map holds together, in
/// its units: between cameras, plus their turns times the depth of what they see. Infinite where
/// there is no way.
double TravelBetween(const Map& map, KeyframeId from, KeyframeId to, int min_shared);

/// Whether the map can have drifted by as much as the loop says, found within it. What looks alike
/// without being the same (posters, windows, tiles) is mostly further apart than that. `reason` (if
/// given) says why not.
bool CanHaveDrifted(const Map& map, const LoopFinding& finding, const DriftOptions& options,
                    std::string* reason = nullptr);

}  // namespace deepuav
