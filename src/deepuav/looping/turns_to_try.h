#pragma once

#include "deepuav/base/option_bounds.h"
#include "deepuav/features/turned_describer.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// Under which quarter turns an image is worth describing to find it at a place whose camera's pose
/// is known in the same map.
struct TurnsToTryOptions {
  double max_turn_deg = 60;   ///< What is left between the turned image and the place's.
  double max_angle_deg = 75;  ///< Between the directions that both cameras look in.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_turn_deg", max_turn_deg, "deg",
          "between an image turned by quarters and that of a place in the same map, for it to be "
          "described so: what descriptors stand, and what the map may have drifted by",
          Between(45, 180));
    visit(
        "max_angle_deg", max_angle_deg, "deg",
        "between the directions that two cameras of one map look in, for the one to be looked for "
        "at the other's place under another heading",
        Between(0, 180));
  }
};

/// Those by which the image of a camera turned about its optical axis looks like that of `place`
/// (both cam_from_world, in one world).
QuarterTurns TurnsToTry(const SE3& camera, const SE3& place, const TurnsToTryOptions& options);

}  // namespace deepuav
