#pragma once

#include <filesystem>

#include "deepuav/geometry/timed_pose.h"

namespace deepuav {

/// Reads TUM ("seconds tx ty tz qx qy qz qw"), EuRoC CSV ("ns, px, py, pz, qw, qx, qy, qz, ..."; of
/// the body where the file is a state_groundtruth_estimate) or KITTI (12 numbers: [R | t] by rows),
/// recognised by the first line. KITTI poses take their times from `kitti_times`, one line of
/// seconds each, else pose i is at i seconds. Time stamps are read exactly, without passing through
/// floating point. Throws Error naming file and line for what is no number, no rotation, or not in
/// order of time.
Trajectory ReadTrajectory(const std::filesystem::path& file,
                          const std::filesystem::path& kitti_times = {});

/// Whether the first line of a file is a KITTI pose, which says nothing of its time. Throws Error
/// where ReadTrajectory does for that line.
bool HoldsKittiPoses(const std::filesystem::path& file);

/// TUM format, written to a temporary name and renamed. Nine decimals: seconds exact, metres to the
/// nanometre. Throws Error naming the file and the reason, also for a pose that is not finite.
void WriteTrajectory(const std::filesystem::path& file, const Trajectory& trajectory);

}  // namespace deepuav
