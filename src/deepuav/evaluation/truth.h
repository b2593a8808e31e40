#pragma once

#include <filesystem>
#include <vector>

#include "deepuav/io/dataset.h"
#include "deepuav/io/trajectory.h"

namespace deepuav {

/// What an estimate is judged by.
struct Truth {
  Trajectory trajectory;
  bool has_orientation = true;  ///< False for fixes: the poses' rotations then mean nothing.
};

/// A position fix of a frame.
struct TimedFix {
  Timestamp time;
  GeoFix fix;
};

/// The fixes in metres east, north and up of the first. Without `use_altitude`, or where any fix
/// has no altitude, all are taken at the ellipsoid's height.
Trajectory LocalTrajectory(const std::vector<TimedFix>& fixes, bool use_altitude);

/// Reads a file as ReadTrajectory does; of a folder with images the truth that lies in it:
/// groundtruth_cam0.csv, groundtruth.txt, mav0/state_groundtruth_estimate0/data.csv (poses of the
/// body, turned into the camera's by the dataset's body_from_cam), else the photographs' EXIF
/// positions. Throws Error if there is none.
Truth LoadTruth(const std::filesystem::path& path, bool use_altitude = true);

}  // namespace deepuav
