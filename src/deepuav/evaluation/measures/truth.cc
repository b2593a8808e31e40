#include "deepuav/evaluation/measures/truth.h"

#include <GeographicLib/Geodesic.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/datasets/euroc_sensor.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/files/yaml_map.h"
#include "deepuav/io/geodata/sensor_files.h"

namespace deepuav {
namespace {

constexpr const char* kCameraTruthFiles[] = {"groundtruth_cam0.csv", "groundtruth.txt"};
constexpr const char *kSensorsFolder = "mav0", *kCameraFolder = "cam0",
                     *kBodyTruthFile = "state_groundtruth_estimate0/data.csv",
                     *kReceiverFile = "gps0/data.csv", *kSensorFile = "sensor.yaml";
constexpr const char *kSimulationFile = "simulation.yaml", *kSummaryFile = "summary.json",
                     *kTrajectoryFile = "trajectory.txt";
constexpr size_t kMaxSummaryBytes = size_t{64} << 20;
constexpr const char *kImagesFolder = "images", *kFixesName = "gps";
constexpr const char* kKittiTimesFile = "times.txt";

/// The file of times that goes with KITTI poses: beside them, or in the sequence's folder of
/// KITTI's own layout (poses/00.txt, sequences/00/times.txt). Empty where there is none.
std::filesystem::path KittiTimes(const std::filesystem::path& poses) {
  const std::filesystem::path folder = std::filesystem::absolute(poses).parent_path();
  for (const std::filesystem::path& times :
       {folder / kKittiTimesFile,
        folder.parent_path() / "sequences" / poses.stem() / kKittiTimesFile}) {
    if (std::filesystem::exists(times)) return times;
  }
  return {};
}

/// KITTI poses with their times, or nothing where no file of times suits them.
std::optional<Trajectory> TimedKittiPoses(const std::filesystem::path& file) {
  const std::filesystem::path times = KittiTimes(file);
  if (times.empty()) return std::nullopt;
  const size_t poses = TextFile(file).lines().size(), lines = TextFile(times).lines().size();
  if (lines == poses) return ReadTrajectory(file, times);
  Log().warn("{}: not used: holds {} times for the {} poses of {}", times.string(), lines, poses,
             file.string());
  return std::nullopt;
}

Trajectory UntimedKittiPoses(const std::filesystem::path& file) {
  Log().warn("{}: no {} goes with these KITTI poses: pose i is taken at i seconds", file.string(),
             kKittiTimesFile);
  return ReadTrajectory(file);
}

Truth ReadPoses(const std::filesystem::path& file) {
  if (!HoldsKittiPoses(file)) return {.trajectory = ReadTrajectory(file)};
  const std::optional<Trajectory> timed = TimedKittiPoses(file);
  return {.trajectory = timed ? *timed : UntimedKittiPoses(file), .has_pose_numbers = true};
}

/// Of a EuRoC dataset's mav0. Its calibration may be no use, as the run may have had another.
Trajectory ReadBodyTruth(const std::filesystem::path& sensors) {
  const std::filesystem::path sensor = sensors / kCameraFolder / kSensorFile;
  if (!std::filesystem::exists(sensor)) {
    throw Error(
        "{}: no such file: expected it for its T_BS, which turns the poses of the body in {} into "
        "the camera's",
        sensor.string(), kBodyTruthFile);
  }
  const SE3 body_from_cam = ReadEurocBodyFromSensor(sensor);
  Trajectory trajectory = ReadTrajectory(sensors / kBodyTruthFile);
  for (TimedPose& pose : trajectory) pose.world_from_cam = pose.world_from_cam * body_from_cam;
  return trajectory;
}

Truth TruthOfFixes(const std::vector<GnssFix>& fixes, bool has_altitude) {
  Truth truth;
  truth.trajectory = LocalTrajectory(fixes, has_altitude);
  if (!fixes.empty()) {
    const GnssFix& first = fixes.front();
    truth.origin = {first.latitude_deg, first.longitude_deg,
                    has_altitude ? first.altitude_m.value_or(0) : 0};
  }
  truth.has_orientation = false;
  truth.has_altitude = has_altitude;
  truth.z_is_up = true;
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
  const SE3 body_from_cam = ReadEurocBodyFromSensor(camera);
  return body_from_cam.Inverse() * ReadEurocBodyFromSensor(sensor).translation();
}

/// What carries a camera is not that fast; two logs in one file are, and a digit that was lost.
void CheckReachable(const GnssFix& before, const GnssFix& after, const std::string& file) {
  constexpr double kFastest_m_s = 1000, kAlwaysNear_m = 100'000;
  double distance_m = 0;
  GeographicLib::Geodesic::WGS84().Inverse(before.latitude_deg, before.longitude_deg,
                                           after.latitude_deg, after.longitude_deg, distance_m);
  const double seconds = SecondsBetween(before.time, after.time);
  if (distance_m <= kAlwaysNear_m || distance_m <= kFastest_m_s * seconds) return;
  throw Error(
      "{}: the position at {} ns lies {:.0f} km from that {} s before: expected at most {} m/s",
      file, after.time.nanoseconds, distance_m / 1000, seconds, kFastest_m_s);
}

Truth ReadReceiver(const std::filesystem::path& file, bool use_altitude) {
  const std::vector<GnssFix> fixes = ReadGnssFile(file);
  for (size_t i = 1; i < fixes.size(); ++i) CheckReachable(fixes[i - 1], fixes[i], file.string());
  Truth truth = TruthOfFixes(fixes, use_altitude && HaveAltitudes(fixes));
  truth.has_own_clock = true;
  truth.antenna_cam_m = AntennaInCamera(std::filesystem::absolute(file));
  return truth;
}

Truth ReadPhotographs(const std::filesystem::path& folder, bool use_altitude) {
  const std::vector<GnssFix> fixes = ReadPhotographFixes(folder);
  if (fixes.empty()) {
    throw Error(
        "{0}: found no truth, expected {1}, {2}, {3}/{4}, {3}/{5} or photographs with EXIF "
        "positions",
        folder.string(), kCameraTruthFiles[0], kCameraTruthFiles[1], kSensorsFolder, kBodyTruthFile,
        kReceiverFile);
  }
  return TruthOfFixes(fixes, use_altitude && HaveAltitudes(fixes));
}

/// Where on Earth a simulated flight's world lies.
std::optional<GeoPoint> SimulatedOrigin(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / kSimulationFile;
  if (!std::filesystem::exists(file)) return std::nullopt;
  const YamlMap options = YamlMap::Read(file);
  if (!options.Has("gnss")) return std::nullopt;
  const YamlMap gnss = options.Map("gnss");
  return GeoPoint{gnss.Number("origin_latitude_deg"), gnss.Number("origin_longitude_deg"),
                  gnss.Number("origin_altitude_m")};
}

/// The origin that the summary beside a run's trajectory tells, if it was georeferenced.
std::optional<GeoPoint> OriginOfRun(const std::filesystem::path& trajectory) {
  const std::filesystem::path file = trajectory.parent_path() / kSummaryFile;
  if (trajectory.filename() != kTrajectoryFile || !std::filesystem::exists(file))
    return std::nullopt;
  try {
    const auto summary = nlohmann::json::parse(ReadBytes(file, kMaxSummaryBytes));
    for (const auto& map : summary.at("maps")) {
      if (map.at("id") != summary.at("main_map") || !map.contains("gauge")) continue;
      if (!map.at("gauge").contains("origin")) return std::nullopt;
      const auto& origin = map.at("gauge").at("origin");
      return GeoPoint{origin.at("latitude_deg"), origin.at("longitude_deg"),
                      origin.at("altitude_m")};
    }
  } catch (const nlohmann::json::exception& error) {
    throw Error("{}: is no summary of a run: {}", file.string(), error.what());
  }
  return std::nullopt;
}

}  // namespace

Truth LoadTruth(const std::filesystem::path& path, const TruthOptions& options) {
  if (!std::filesystem::exists(path)) throw Error("{}: no such file or folder", path.string());
  if (!std::filesystem::is_directory(path)) {
    if (IsGnssFile(path)) return ReadReceiver(path, options.altitude);
    return ReadPoses(path);
  }
  const bool is_sensors = std::filesystem::is_directory(path / kCameraFolder);
  const std::filesystem::path sensors = is_sensors ? path : path / kSensorsFolder;
  std::vector<std::filesystem::path> folders{path};
  if (is_sensors) folders.push_back(std::filesystem::absolute(path / "..").lexically_normal());
  for (const std::filesystem::path& folder : folders) {
    for (const char* name : kCameraTruthFiles) {
      if (!std::filesystem::exists(folder / name)) continue;
      Truth truth = ReadPoses(folder / name);
      truth.origin = SimulatedOrigin(folder);
      truth.z_is_up = std::filesystem::is_directory(sensors / kCameraFolder);
      return truth;
    }
  }
  if (std::filesystem::exists(sensors / kBodyTruthFile))
    return {.trajectory = ReadBodyTruth(sensors), .z_is_up = true};
  if (std::filesystem::exists(sensors / kReceiverFile))
    return ReadReceiver(sensors / kReceiverFile, options.altitude);
  if (const std::filesystem::path fixes = FindGnssBeside({path / kImagesFolder, path}, kFixesName);
      !fixes.empty())
    return ReadReceiver(fixes, options.altitude);
  return ReadPhotographs(path, options.altitude && options.photograph_altitude);
}

Trajectory LoadEstimate(const std::filesystem::path& file, const Truth& truth) {
  if (!HoldsKittiPoses(file)) {
    const Trajectory estimate = ReadTrajectory(file);
    const auto origin = truth.origin ? OriginOfRun(file) : std::nullopt;
    if (!origin) return estimate;
    return MoveTrajectory(Sim3(LocalFromLocal(*truth.origin, *origin)), estimate);
  }
  if (std::optional<Trajectory> timed = TimedKittiPoses(file)) return *timed;
  Trajectory poses = ReadTrajectory(file);
  if (!truth.has_pose_numbers || poses.size() != truth.trajectory.size())
    return UntimedKittiPoses(file);
  for (size_t i = 0; i < poses.size(); ++i) poses[i].time = truth.trajectory[i].time;
  return poses;
}

}  // namespace deepuav
