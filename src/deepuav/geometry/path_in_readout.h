#pragma once

#include <cstddef>
#include <optional>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/rolling_shutter.h"
#include "deepuav/geometry/timed_pose.h"

namespace deepuav {

struct PathInReadoutOptions {
  int reach = 5;            ///< Poses on each side that tell how the camera moves at one...
  double max_step_s = 0.2;  ///< ...none of them so much later than the one before.

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("reach", reach, "", "poses on each side that tell how the camera moves at one",
          Between(1, 8));
    visit("max_step_s", max_step_s, "s",
          "between two poses, beyond which they don't tell how the camera moved meanwhile",
          Above(0, 10));
  }
};

/// How the camera moves while it reads the image of path[at], by the polynomial through the poses
/// about it, as many before as after but for the ends of the path: turn, its bend, and travel in
/// the path's units. Nothing where there are no three poses in a row.
std::optional<ReadoutMotion> MotionOnPath(const Trajectory& path, size_t at, double readout_s,
                                          const PathInReadoutOptions& options);

/// How much a path tells of the camera's turning, as root mean squares.
struct MissedTurns {
  double missed_rad = 0;   ///< What such polynomials, led past a pose, miss its orientation by.
  double stepped_rad = 0;  ///< The turn from one pose to the next.

  /// Well below 1 of a camera that turns steadily; about 1 or more of one that shakes faster than
  /// it takes images, whose derivatives are noise, and of one that does not turn.
  double share() const { return stepped_rad > 0 ? missed_rad / stepped_rad : 0; }
};

/// Nothing where there are no three poses in a row.
std::optional<MissedTurns> TurnsMissed(const Trajectory& path, const PathInReadoutOptions& options);

}  // namespace deepuav
