#include "deepuav/assembly/run_output.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>

#include "deepuav/assembly/frame_table.h"
#include "deepuav/io/atomic_file.h"
#include "deepuav/io/geo_trajectory.h"
#include "deepuav/io/map_export.h"
#include "deepuav/io/map_file.h"
#include "deepuav/io/options_file.h"
#include "deepuav/io/point_cloud.h"
#include "deepuav/io/trajectory.h"

namespace deepuav {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180 / M_PI;  // In a radian.

using FrameCounts = std::map<MapId, int>;

/// Has an entry for every map of the atlas.
FrameCounts FramesByMap(const Atlas& atlas, const SlamResult& result) {
  FrameCounts frames;
  for (MapId map : atlas.Remaining()) frames[map] = 0;
  for (const FrameRecord& record : result.frames) {
    if (record.located()) ++frames[atlas.Current(record.map)];
  }
  return frames;
}

/// The map in which most frames lie, the first of equals; invalid where there is none.
MapId MainMap(const FrameCounts& frames_by_map) {
  if (frames_by_map.empty()) return {};
  return std::max_element(frames_by_map.begin(), frames_by_map.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

Trajectory FrameTrajectory(const SlamResult& result, MapId map) {
  Trajectory trajectory;
  for (const FrameRecord& record : result.frames) {
    if (record.located() && record.map == map)
      trajectory.push_back({record.time, record.cam_from_world.Inverse()});
  }
  return trajectory;
}

double Quantile(std::vector<double> values, double quantile) {
  if (values.empty()) return 0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(
                                          quantile * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

Json StageTable(const SlamResult& result) {
  Json table = Json::object();
  for (const auto& [stage, durations] : result.stage_durations_s) {
    double total_s = 0;
    for (double seconds : durations) total_s += seconds;
    table[stage] = {{"count", durations.size()},
                    {"median_ms", 1e3 * Quantile(durations, 0.5)},
                    {"p95_ms", 1e3 * Quantile(durations, 0.95)},
                    {"total_s", total_s}};
  }
  return table;
}

std::string TimingsCsv(const SlamResult& result) {
  std::string csv = "stage,call,milliseconds\n";
  for (const auto& [stage, durations] : result.stage_durations_s) {
    for (size_t i = 0; i < durations.size(); ++i)
      csv += fmt::format("{},{},{:.4f}\n", stage, i, 1e3 * durations[i]);
  }
  return csv;
}

double PeakResidentMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

Json ModelTable(const std::vector<UsedModel>& models) {
  Json table = Json::array();
  for (const auto& [use, model] : models) {
    Json row = {{"use", use}, {"file", model.file.string()}, {"sha256", model.sha256}};
    row["shipped_as"] = model.name.empty() ? Json() : Json(model.name);
    table.push_back(std::move(row));
  }
  return table;
}

int CountTrackedOnline(const SlamResult& result) {
  return static_cast<int>(std::count_if(
      result.frames.begin(), result.frames.end(),
      [](const FrameRecord& record) { return record.located() && record.tracked_online; }));
}

Json SensorTable(const RunFacts& facts) {
  Json table = {{"use", facts.use}, {"found", Json::array()}};
  for (const SensorFacts& sensor : facts.sensors) {
    Json row = {{"sensor", sensor.name},
                {"source", sensor.source},
                {"samples", sensor.samples},
                {"used", sensor.used}};
    if (!sensor.used) row["reason"] = sensor.note;
    table["found"].push_back(std::move(row));
  }
  return table;
}

/// What an inertial sensor told, or why it did not.
Json InertialTable(const InertialAttempt& attempt) {
  if (!attempt.found) return {{"reason", attempt.reason}};
  const InertialAlignment& found = *attempt.found;
  const auto numbers = [](const Eigen::Vector3d& v) { return Json{v.x(), v.y(), v.z()}; };
  return {{"scale_sigma", found.scale_sigma},
          {"tilt_sigma_deg", found.tilt_sigma_rad * kDegrees},
          {"clock_offset_s", found.clock_offset_s},
          {"clock_sigma_s", found.clock_sigma_s},
          {"gyroscope_bias_rad_s", numbers(found.bias.gyroscope_rad_s)},
          {"accelerometer_bias_m_s2", numbers(found.bias.accelerometer_m_s2)},
          {"turn_residual_deg", found.turn_residual_rad * kDegrees},
          {"position_residual_m", found.position_residual_m},
          {"chi_square", found.chi_square},
          {"scale_spread", found.scale_spread},
          {"duration_s", found.duration_s}};
}

void AddGeoreference(const GeoreferenceReport& report, Json* table) {
  if (!report.found) {
    (*table)["reason"] = report.reason;
    return;
  }
  const Georeference& found = *report.found;
  (*table)["fixes"] = {{"on_path", report.fixes},
                       {"used", report.used},
                       {"horizontal_rms_m", report.horizontal_rms_m},
                       {"vertical_rms_m", report.vertical_rms_m},
                       {"spread_over_stated", found.horizontal_ratio}};
  (*table)["turn_sigma_deg"] = found.turn_sigma_rad() * kDegrees;
  (*table)["clock_offset_s"] = found.clock_offset_s;
  (*table)["barometer_steps"] = report.height_steps;
}

/// The entry of a map, or null.
template <typename Entry>
const Entry* EntryOf(const std::map<MapId, Entry>& entries, MapId map) {
  const auto found = entries.find(map);
  return found == entries.end() ? nullptr : &found->second;
}

/// Of a map: what its world means and how it came to it.
Json GaugeTable(MapId map, const Gauge& gauge, const SlamResult& result) {
  Json table = {{"kind", GaugeName(gauge.kind)}};
  if (gauge.kind == GaugeKind::kGeoreferenced) {
    table["origin"] = {{"latitude_deg", gauge.origin.latitude_deg},
                       {"longitude_deg", gauge.origin.longitude_deg},
                       {"altitude_m", gauge.origin.altitude_m}};
  }
  if (gauge.kind != GaugeKind::kFree) table["scale_sigma"] = gauge.scale_sigma;
  if (const auto* report = EntryOf(result.georeferences, map)) AddGeoreference(*report, &table);
  if (const auto* attempt = EntryOf(result.inertial, map)) table["imu"] = InertialTable(*attempt);
  return table;
}

Json Summary(const Atlas& atlas, const SlamResult& result, const RunFacts& facts) {
  const FrameCounts frames = FramesByMap(atlas, result);
  Json maps = Json::array();
  int located = 0;
  const std::map<MapId, int64_t> numbers = NumbersInFile(atlas);
  for (const auto& [id, count] : frames) {
    const Map& map = atlas.At(id);
    maps.push_back({{"id", numbers.at(id)},
                    {"keyframes", map.KeyframeCount()},
                    {"landmarks", map.LandmarkCount()},
                    {"frames", count},
                    {"gauge", GaugeTable(id, atlas.GaugeOf(id), result)}});
    located += count;
  }
  const MapId main = MainMap(frames);
  const auto processed = static_cast<int>(result.frames.size());
  return {{"version", DEEPUAV_VERSION},
          {"dataset",
           {{"path", facts.dataset_path},
            {"kind", facts.dataset_kind},
            {"camera_file", facts.camera_file}}},
          {"schedule", facts.schedule},
          {"stopped_early", result.stopped},
          {"frames",
           {{"images", facts.images},
            {"unreadable", facts.unreadable},
            {"skipped_late", result.skipped_late},
            {"processed", processed},
            {"tracked_online", CountTrackedOnline(result)},
            {"located", located},
            {"lost", processed - located}}},
          {"main_map", main.valid() ? numbers.at(main) : main.value},
          {"maps", maps},
          {"sensors", SensorTable(facts)},
          {"features", facts.features},
          {"matcher", facts.matcher},
          {"vocabulary", facts.vocabulary},
          {"models", ModelTable(facts.models)},
          {"relocalisations", result.relocalisations},
          {"closed_loops", result.closed_loops},
          {"merged_maps", result.merged_maps},
          {"wall_s", facts.wall_s},
          {"start_up_s", facts.start_up_s},
          {"peak_resident_mb", PeakResidentMb()},
          {"stages", StageTable(result)},
          {"options", facts.options}};
}

/// Names of files need not be UTF-8, but JSON is.
std::string SummaryJson(const Json& summary) {
  return summary.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
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

RunFacts FactsOf(const Eyes& eyes, const RunSettings& settings) {
  RunFacts facts;
  facts.features = eyes.extractor().Description();
  facts.matcher = eyes.matcher().Description();
  facts.vocabulary = eyes.VocabularyDescription();
  facts.models = eyes.models();
  facts.options = OptionTexts(settings.registry);
  facts.options_yaml = OptionsAsYaml(settings.registry);
  return facts;
}

std::string SummaryText(const Atlas& atlas, const SlamResult& result, const RunFacts& facts) {
  return SummaryJson(Summary(atlas, result, facts));
}

MapId MainMapOf(const Atlas& atlas, const SlamResult& result) {
  return MainMap(FramesByMap(atlas, result));
}

void WriteRunOutput(const std::filesystem::path& folder, const Atlas& atlas, const Camera& camera,
                    const SlamResult& result, const RunFacts& facts) {
  const MapId main = MainMapOf(atlas, result);
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
  attempt([&] { WriteFileAtomically(folder / "timings.csv", TimingsCsv(result)); });
  attempt([&] { WriteFileAtomically(folder / "options.yaml", facts.options_yaml); });
  attempt([&] { WriteFileAtomically(folder / "camera.yaml", CalibrationYaml(facts.calibration)); });
  attempt([&] { WriteFileAtomically(folder / "summary.json", SummaryText(atlas, result, facts)); });
  // The large ones last: on a full disk the others are there.
  attempt([&] {
    WritePly(folder / "points.ply",
             main.valid() ? LandmarkPoints(atlas.At(main)) : std::vector<ColoredPoint>{});
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
  text += fmt::format("{} frames in {:.1f} s: {:.1f} frames/s; peak memory {:.0f} MB\n",
                      result.frames.size(), facts.wall_s,
                      static_cast<double>(result.frames.size()) / std::max(facts.wall_s, 1e-9),
                      PeakResidentMb());
  return text;
}

}  // namespace deepuav
