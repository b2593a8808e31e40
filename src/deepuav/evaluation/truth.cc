#include "deepuav/evaluation/truth.h"

#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <memory>
#include <optional>

#include "deepuav/base/error.h"
#include "deepuav/io/euroc_sensor.h"

namespace deepuav {
namespace {

constexpr const char* kCameraTruthFiles[] = {"groundtruth_cam0.csv", "groundtruth.txt"};
constexpr const char* kBodyTruthFile = "mav0/state_groundtruth_estimate0/data.csv";
constexpr const char *kReceiverFile = "mav0/gps0/data.csv", *kCameraFolder = "cam0",
                     *kSensorFile = "sensor.yaml";

Trajectory ReadBodyTruth(const std::filesystem::path& folder) {
  const std::optional<SE3> body_from_cam = OpenDataset(folder)->BodyFromCam();
  if (!body_from_cam) {
    throw Error(
        "{}: found no T_BS, expected it to turn the poses of the body in {} into the camera's",
        folder.string(), kBodyTruthFile);
  }
  Trajectory trajectory = ReadTrajectory(folder / kBodyTruthFile);
  for (TimedPose& pose : trajectory) pose.world_from_cam = pose.world_from_cam * *body_from_cam;
  return trajectory;
}

bool HaveAltitudes(const std::vector<TimedFix>& fixes) {
  return std::all_of(fixes.begin(), fixes.end(),
                     [](const TimedFix& timed) { return timed.fix.altitude_m.has_value(); });
}

Truth TruthOfFixes(const std::vector<TimedFix>& fixes, bool has_altitude) {
  Truth truth;
  truth.trajectory = LocalTrajectory(fixes, has_altitude);
  truth.has_orientation = false;
  truth.has_altitude = has_altitude;
  return truth;
}

/// Where the receiver's antenna is in the camera, if the file lies in a EuRoC dataset that says so.
Eigen::Vector3d AntennaInCamera(const std::filesystem::path& receiver_file) {
  const std::filesystem::path sensor = receiver_file.parent_path() / kSensorFile;
  const std::filesystem::path camera =
      receiver_file.parent_path().parent_path() / kCameraFolder / kSensorFile;
  if (!std::filesystem::exists(sensor) || !std::filesystem::exists(camera)) {
    return Eigen::Vector3d::Zero();
  }
  const SE3 body_from_cam = ReadEurocSensor(camera).body_from_cam;
  return body_from_cam.Inverse() * ReadEurocBodyFromSensor(sensor).translation();
}

Truth ReadReceiver(const std::filesystem::path& file, bool use_altitude) {
  const std::vector<TimedFix> fixes = ReadGnssFile(file);
  Truth truth = TruthOfFixes(fixes, use_altitude && HaveAltitudes(fixes));
  truth.has_own_clock = true;
  truth.antenna_cam_m = AntennaInCamera(std::filesystem::absolute(file));
  return truth;
}

Truth ReadPhotographs(const std::filesystem::path& folder, bool use_altitude) {
  const std::unique_ptr<Dataset> dataset = OpenDataset(folder);
  std::vector<TimedFix> fixes;
  for (int frame = 0; frame < dataset->size(); ++frame) {
    if (const std::optional<GeoFix> fix = dataset->Fix(frame)) {
      fixes.push_back({dataset->Time(frame), *fix});
    }
  }
  if (fixes.empty()) {
    throw Error("{}: found no truth, expected {}, {}, {}, {} or photographs with EXIF positions",
                folder.string(), kCameraTruthFiles[0], kCameraTruthFiles[1], kBodyTruthFile,
                kReceiverFile);
  }
  return TruthOfFixes(fixes, use_altitude && HaveAltitudes(fixes));
}

}  // namespace

Trajectory LocalTrajectory(const std::vector<TimedFix>& fixes, bool use_altitude) {
  const bool has_altitude = use_altitude && HaveAltitudes(fixes);
  const auto altitude_m = [has_altitude](const GeoFix& fix) {
    return has_altitude ? fix.altitude_m.value_or(0) : 0.0;
  };
  Trajectory trajectory;
  if (fixes.empty()) return trajectory;
  const GeoFix& origin = fixes.front().fix;
  const GeographicLib::LocalCartesian local(origin.latitude_deg, origin.longitude_deg,
                                            altitude_m(origin));
  for (const TimedFix& timed : fixes) {
    Eigen::Vector3d position_m;
    local.Forward(timed.fix.latitude_deg, timed.fix.longitude_deg, altitude_m(timed.fix),
                  position_m.x(), position_m.y(), position_m.z());
    trajectory.push_back({timed.time, SE3(Eigen::Quaterniond::Identity(), position_m)});
  }
  return trajectory;
}

Truth LoadTruth(const std::filesystem::path& path, const TruthOptions& options) {
  if (!std::filesystem::exists(path)) throw Error("{}: no such file or folder", path.string());
  if (!std::filesystem::is_directory(path)) {
    if (IsGnssFile(path)) return ReadReceiver(path, options.altitude);
    return {.trajectory = ReadTrajectory(path)};
  }
  for (const char* name : kCameraTruthFiles) {
    if (std::filesystem::exists(path / name)) return {.trajectory = ReadTrajectory(path / name)};
  }
  if (std::filesystem::exists(path / kBodyTruthFile)) return {.trajectory = ReadBodyTruth(path)};
  if (std::filesystem::exists(path / kReceiverFile)) {
    return ReadReceiver(path / kReceiverFile, options.altitude);
  }
  return ReadPhotographs(path, options.altitude && options.photograph_altitude);
}

}  // namespace deepuav
