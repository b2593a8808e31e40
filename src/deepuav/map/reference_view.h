#pragma once

#include <functional>

#include "deepuav/base/option_bounds.h"
#include "deepuav/map/map.h"

namespace deepuav {

struct ReferenceViewOptions {
  double max_angle_deg = 30;    ///< Between the directions from which two views see a landmark.
  double max_scale_change = 2;  ///< Of their distances to it.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_angle_deg", max_angle_deg, "deg",
          "between the directions from which a patch and its reference are seen", Above(0, 90));
    visit("max_scale_change", max_scale_change, "",
          "ratio of the distances from which a patch and its reference are seen", Above(1, 10));
  }
};

/// Whose patch a view from `centre_world` is to be aligned with: the oldest observation (so that
/// errors do not add up from view to view) that saw the landmark from about there; where none did,
/// the nearest in direction and distance. Only of observations that `may_serve`, whose keyframe has
/// its image and that were found by patches: a key point is no patch's middle. Null where there
/// is none.
const Observation* ReferenceObservation(const Map& map, const Landmark& landmark,
                                        const Eigen::Vector3d& centre_world,
                                        const std::function<bool(const Observation&)>& may_serve,
                                        const ReferenceViewOptions& options);

/// The observation, of those that ReferenceObservation would take, from where the landmark looks
/// least different from what the others saw. Null where there is none.
const Observation* MiddleObservation(const Map& map, const Landmark& landmark,
                                     const ReferenceViewOptions& options);

/// Whether two keyframes see the landmark from about the same direction and distance.
bool LooksAlike(const Map& map, const Landmark& landmark, KeyframeId a, KeyframeId b,
                const ReferenceViewOptions& options);

}  // namespace deepuav
