#include "deepuav/evaluation/truth.h"

#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <memory>
#include <optional>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr const char* kCameraTruthFiles[] = {"groundtruth_cam0.csv", "groundtruth.txt"};
constexpr const char* kBodyTruthFile = "mav0/state_groundtruth_estimate0/data.csv";

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

Trajectory ReadFixes(const std::filesystem::path& folder, bool use_altitude) {
  const std::unique_ptr<Dataset> dataset = OpenDataset(folder);
  std::vector<TimedFix> fixes;
  for (int frame = 0; frame < dataset->size(); ++frame) {
    if (const std::optional<GeoFix> fix = dataset->Fix(frame)) {
      fixes.push_back({dataset->Time(frame), *fix});
    }
  }
  if (fixes.empty()) {
    throw Error("{}: found no truth, expected {}, {}, {} or photographs with EXIF positions",
                folder.string(), kCameraTruthFiles[0], kCameraTruthFiles[1], kBodyTruthFile);
  }
  return LocalTrajectory(fixes, use_altitude);
}

}  // namespace

Trajectory LocalTrajectory(const std::vector<TimedFix>& fixes, bool use_altitude) {
  const bool has_altitude =
      use_altitude && std::all_of(fixes.begin(), fixes.end(), [](const TimedFix& timed) {
        return timed.fix.altitude_m.has_value();
      });
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

Truth LoadTruth(const std::filesystem::path& path, bool use_altitude) {
  if (!std::filesystem::exists(path)) throw Error("{}: no such file or folder", path.string());
  if (!std::filesystem::is_directory(path)) return {ReadTrajectory(path), true};
  for (const char* name : kCameraTruthFiles) {
    if (std::filesystem::exists(path / name)) return {ReadTrajectory(path / name), true};
  }
  if (std::filesystem::exists(path / kBodyTruthFile)) return {ReadBodyTruth(path), true};
  return {ReadFixes(path, use_altitude), false};
}

}  // namespace deepuav
