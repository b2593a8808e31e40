#include "deepuav/assembly/output/run_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <map>
#include <string_view>

#include "deepuav/assembly/output/frame_table.h"
#include "deepuav/assembly/output/run_summary.h"
#include "deepuav/io/files/atomic_file.h"
#include "deepuav/io/geodata/geo_trajectory.h"
#include "deepuav/io/geodata/trajectory.h"
#include "deepuav/io/maps/map_export.h"
#include "deepuav/io/maps/map_file.h"
#include "deepuav/io/maps/point_cloud.h"

namespace deepuav {
namespace {

Trajectory FrameTrajectory(const SlamResult& result, MapId map) {
  Trajectory trajectory;
  for (const FrameRecord& record : result.frames) {
    if (record.located() && record.map == map)
      trajectory.push_back({record.time, record.cam_from_world.Inverse()});
  }
  return trajectory;
}

std::string TimingsCsv(const SlamResult& result) {
  std::string csv = "stage,call,milliseconds\n";
  for (const auto& [stage, durations] : result.stage_durations_s) {
    for (size_t i = 0; i < durations.size(); ++i)
      csv += fmt::format("{},{},{:.4f}\n", stage, i, 1e3 * durations[i]);
  }
  return csv;
}

constexpr std::string_view kMapTrajectoryStart = "trajectory-map-", kMapTrajectoryEnd = ".txt";

std::string MapTrajectoryName(int64_t map) {
  return fmt::format("{}{}{}", kMapTrajectoryStart, map, kMapTrajectoryEnd);
}

bool IsMapTrajectory(std::string_view name) {
  if (!name.starts_with(kMapTrajectoryStart) || !name.ends_with(kMapTrajectoryEnd)) return false;
  name.remove_prefix(kMapTrajectoryStart.size());
  name.remove_suffix(kMapTrajectoryEnd.size());
  return !name.empty() && name.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Those of an earlier run would be taken for this one's.
void RemoveMapTrajectories(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (IsMapTrajectory(entry.path().filename().string())) found.push_back(entry.path());
  }
  for (const std::filesystem::path& file : found) std::filesystem::remove(file);
}

/// Those of an earlier run would be taken for this one's where this map has no place on Earth.
void WriteGeoTrajectories(const std::filesystem::path& folder, const Gauge& gauge,
                          const Trajectory& path) {
  constexpr std::pair<const char*,
                      void (*)(const std::filesystem::path&, const GeoPoint&, const Trajectory&)>
      kFiles[] = {{"trajectory.geojson", WriteGeoJson},
                  {"trajectory.kml", WriteKml},
                  {"trajectory.gpx", WriteGpx}};
  for (const auto& [name, write] : kFiles) {
    if (gauge.kind == GaugeKind::kGeoreferenced) {
      write(folder / name, gauge.origin, path);
    } else {
      std::filesystem::remove(folder / name);
    }
  }
}

}  // namespace

void WriteRunOutput(const std::filesystem::path& folder, const Atlas& atlas, const Camera& camera,
                    const SlamResult& result, const RunFacts& facts) {
  const MapId main = MainMap(FramesByMap(atlas, result));
  std::exception_ptr first_failure;
  const auto attempt = [&first_failure](const auto& write) {
    try {
      write();
    } catch (...) {
      if (!first_failure) first_failure = std::current_exception();
    }
  };
  attempt([&] { WriteTrajectory(folder / "trajectory.txt", FrameTrajectory(result, main)); });
  attempt([&] {
    WriteTrajectory(
        folder / "keyframes.txt",
        main.valid() ? KeyframeTrajectory(atlas.At(main), facts.first_new_keyframe) : Trajectory{});
  });
  attempt([&] {
    WriteGeoTrajectories(folder, main.valid() ? atlas.GaugeOf(main) : Gauge{},
                         FrameTrajectory(result, main));
  });
  attempt([&] { RemoveMapTrajectories(folder); });
  for (const auto& [map, number] : NumbersInFile(atlas)) {
    if (map == main) continue;
    attempt(
        [&] { WriteTrajectory(folder / MapTrajectoryName(number), FrameTrajectory(result, map)); });
  }
  attempt([&] {
    WriteFileAtomically(folder / "frames.csv", FrameTable(atlas, result, facts.first_new_keyframe));
  });
  attempt([&] { WriteFileAtomically(folder / "poses.csv", PoseTable(atlas, result)); });
  attempt([&] { WriteFileAtomically(folder / "timings.csv", TimingsCsv(result)); });
  attempt([&] { WriteFileAtomically(folder / "options.yaml", facts.options_yaml); });
  attempt([&] { WriteFileAtomically(folder / "camera.yaml", CalibrationYaml(facts.calibration)); });
  attempt([&] { WriteFileAtomically(folder / "summary.json", SummaryText(atlas, result, facts)); });
  // The large ones last: on a full disk the others are there.
  attempt([&] {
    WritePly(folder / "points.ply",
             main.valid() ? LandmarkPoints(atlas.At(main)) : std::vector<ColouredPoint>{});
  });
  attempt([&] { WriteMapFile(folder / "map.deepuav", atlas, camera, facts.map_origin); });
  if (first_failure) std::rethrow_exception(first_failure);
}

std::string DescribeRun(const Atlas& atlas, const SlamResult& result, const RunFacts& facts) {
  std::string text;
  const std::map<MapId, int64_t> numbers = NumbersInFile(atlas);
  for (const auto& [id, count] : FramesByMap(atlas, result)) {
    const Map& map = atlas.At(id);
    text += fmt::format("map {}: {} of {} frames, {} keyframes, {} landmarks\n", numbers.at(id),
                        count, result.frames.size(), map.KeyframeCount(), map.LandmarkCount());
  }
  text += CalibrationText(facts.calibration);
  text += fmt::format(
      "{} frames in {:.1f} s: {:.1f} frames/s, after {:.1f} s to start up; peak memory {:.0f} MB\n",
      result.frames.size(), facts.wall_s,
      static_cast<double>(result.frames.size()) / std::max(facts.wall_s, 1e-9), facts.start_up_s,
      PeakResidentMb());
  return text;
}

}  // namespace deepuav
