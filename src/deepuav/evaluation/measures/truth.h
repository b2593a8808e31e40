#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "deepuav/io/geodata/gnss_file.h"
#include "deepuav/io/geodata/trajectory.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {

/// What an estimate is judged by.
struct Truth {
  Trajectory trajectory;
  bool has_orientation = true;    ///< False for fixes: the poses' rotations then mean nothing.
  bool has_altitude = true;       ///< False: z means nothing, and errors are horizontal.
  bool has_own_clock = false;     ///< Taken at other moments than the images, as by a receiver.
  bool has_pose_numbers = false;  ///< Of KITTI: its poses are told apart by their lines.
  bool z_is_up = false;           ///< Known to be; false where nothing says so.
  Eigen::Vector3d antenna_cam_m = Eigen::Vector3d::Zero();  ///< Whose positions they are.
  std::optional<GeoPoint> origin =
      std::nullopt;  ///< Of its metres east, north and up, where that is known.
};

/// Which altitudes of fixes are used.
struct TruthOptions {
  bool altitude = true;              ///< Of receivers.
  bool photograph_altitude = false;  ///< Of EXIF: often of another origin, or a constant.
};

/// Reads a file of poses as ReadTrajectory does (those of KITTI with the times.txt beside them, or
/// that of the folder sequences/NAME beside theirs where they are called NAME.txt, if it has a line
/// for each; else pose i is at i seconds, and a warning says so) or of fixes as ReadGnssFile does;
/// of a folder with images the truth that lies in it: groundtruth_cam0.csv, groundtruth.txt,
/// mav0/state_groundtruth_estimate0/data.csv (poses of the body, turned into the camera's by the
/// dataset's body_from_cam), mav0/gps0/data.csv (the folder may be mav0 itself, or called
/// otherwise, with cam0 in it), the receiver's gps.csv or gps.gpx beside photographs or their
/// folder, else the photographs' EXIF positions. The antenna's place is known
/// where a sensor.yaml with T_BS lies beside the file of fixes and in the folder cam0 beside that.
/// Throws Error if there is no truth.
Truth LoadTruth(const std::filesystem::path& path, const TruthOptions& options = {});
/// Reads the poses to be judged, about the truth's origin where both places on Earth are known: a
/// run tells its own in the summary.json beside its trajectory.txt. Those of KITTI without a
/// times.txt have the times of a truth of KITTI with as many poses.
Trajectory LoadEstimate(const std::filesystem::path& file, const Truth& truth);
inline Truth LoadTruth(const std::filesystem::path& path, bool use_altitude) {
  return LoadTruth(path, TruthOptions{.altitude = use_altitude});
}

}  // namespace deepuav
