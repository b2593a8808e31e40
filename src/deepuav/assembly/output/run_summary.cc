#include "deepuav/assembly/output/run_summary.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "deepuav/io/maps/map_file.h"

namespace deepuav {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180 / M_PI;  // In a radian.

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

Json ModelTable(const std::vector<UsedModel>& models) {
  Json table = Json::array();
  for (const auto& [use, model] : models) {
    Json row = {{"use", use}, {"file", model.file.string()}, {"sha256", model.sha256}};
    row["shipped_as"] = model.name.empty() ? Json() : Json(model.name);
    table.push_back(std::move(row));
  }
  return table;
}

int CountReckoned(const SlamResult& result) {
  return static_cast<int>(std::count_if(result.frames.begin(), result.frames.end(),
                                        [](const FrameRecord& record) { return record.reckoned; }));
}

int CountInferred(const SlamResult& result) {
  return static_cast<int>(std::count_if(result.frames.begin(), result.frames.end(),
                                        [](const FrameRecord& record) { return record.inferred; }));
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
  Json table = {{"scale_sigma", found.scale_sigma},
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
  if (found.mount_sigma_rad > 0) {
    const Eigen::Quaterniond& mount = found.cam_from_imu.rotation();
    table["mount"] = {{"cam_from_imu_wxyz", {mount.w(), mount.x(), mount.y(), mount.z()}},
                      {"sigma_deg", found.mount_sigma_rad * kDegrees}};
  }
  return table;
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
  (*table)["held_by_imu"] = report.held_by_imu;
  (*table)["held_by_attitude"] = report.held_by_attitude;
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

Json LiveTable(const LiveFacts& live) {
  return {{"arrived", live.arrived},
          {"late", live.late},
          {"frozen", live.frozen},
          {"misfits", live.misfits},
          {"reconnects", live.reconnects},
          {"latency_frames", live.posed},
          {"median_latency_ms", 1e3 * live.median_latency_s},
          {"p95_latency_ms", 1e3 * live.p95_latency_s}};
}

/// What the images told of a rolling shutter, or null.
Json ReadoutTable(const SlamResult& result, const RunFacts& facts) {
  if (!result.readout) return nullptr;
  constexpr double kMillisecondsASecond = 1000;
  return {{"ms", kMillisecondsASecond * facts.calibration.camera.readout_s},
          {"sigma_ms", kMillisecondsASecond * result.readout->sigma_s}};
}

/// Of a told focal length that the images contradict, or null.
Json FocalDoubtTable(const SlamResult& result, const RunFacts& facts) {
  if (!result.focal_doubt) return nullptr;
  const double told_px = facts.calibration.start_focal_px;
  const double better_px = result.focal_doubt->ratio * told_px;
  return {{"told_px", told_px},
          {"fits_better_px", better_px},
          {"sigma_px", result.focal_doubt->sigma * better_px}};
}

Json CountsTable(const SlamResult& result, const RunFacts& facts, int located) {
  const auto processed = static_cast<int>(result.frames.size());
  return {{"images", facts.images},
          {"unreadable", facts.unreadable},
          {"damaged", facts.damaged},
          {"skipped_late", result.skipped_late},
          {"processed", processed},
          {"tracked_online", CountTrackedOnline(result)},
          {"located", located},
          {"reckoned", CountReckoned(result)},
          {"inferred", CountInferred(result)},
          {"lost", processed - located},
          {"forgotten", result.forgotten_frames}};
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
  Json summary = {{"version", DEEPUAV_VERSION},
                  {"dataset",
                   {{"path", facts.dataset_path},
                    {"kind", facts.dataset_kind},
                    {"camera_file", facts.camera_file}}},
                  {"schedule", facts.schedule},
                  {"stopped_early", result.stopped},
                  {"frames", CountsTable(result, facts, located)},
                  {"found_readout", ReadoutTable(result, facts)},
                  {"doubtful_focal_length", FocalDoubtTable(result, facts)},
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
                  {"maps_joined_by_imu", result.maps_joined_by_imu},
                  {"maps_joined_by_fixes", result.maps_joined_by_fixes},
                  {"maps_given_up", result.maps_given_up},
                  {"doubtful_photographs", result.doubtful_photographs},
                  {"landmarks_set_aside", result.landmarks_set_aside},
                  {"image_fixed",
                   {{"image_share", result.image_fixed.Share()},
                    {"key_point_share", result.image_fixed_keypoint_share}}},
                  {"wall_s", facts.wall_s},
                  {"start_up_s", facts.start_up_s},
                  {"peak_resident_mb", PeakResidentMb()},
                  {"stages", StageTable(result)},
                  {"options", facts.options}};
  if (facts.live) summary["live"] = LiveTable(*facts.live);
  return summary;
}

/// Names of files need not be UTF-8, but JSON is.
std::string SummaryJson(const Json& summary) {
  return summary.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string SummaryText(const Atlas& atlas, const SlamResult& result, const RunFacts& facts) {
  return SummaryJson(Summary(atlas, result, facts));
}

}  // namespace deepuav
