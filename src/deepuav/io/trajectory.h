#pragma once

#include <filesystem>
#include <vector>

#include "deepuav/base/time.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

struct TimedPose {
  Timestamp time;
  SE3 world_from_cam;
};

/// Poses by growing time.
using Trajectory = std::vector<TimedPose>;

/// Reads TUM ("seconds tx ty tz qx qy qz qw"), EuRoC CSV ("ns, px, py, pz, qw, qx, qy, qz, ..."), recognised by their
/// content. Time stamps are read exactly, without passing through floating point. Throws Error naming file and line.
Trajectory ReadTrajectory(const std::filesystem::path& file);

/// TUM format, written to a temporary name and renamed. Nine decimals of seconds, exact.
void WriteTrajectory(const std::filesystem::path& file, const Trajectory& trajectory);

}  // namespace deepuav
