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

/// How much the path tells of the camera's turning: by how much such polynomials, led past a pose,
/// miss its orientation, over the turn from one pose to the next (root mean squares). Well below 1
/// of a camera that turns steadily; about 1 or more of one that shakes faster than it takes images,
/// whose derivatives are noise. Nothing where there are no three poses in a row.
std::optional<double> TurnsMissed(const Trajectory& path, const PathInReadoutOptions& options);

}  // namespace deepuav
