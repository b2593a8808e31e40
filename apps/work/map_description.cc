#include "work/map_description.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "deepuav/io/files/text_file.h"
#include "deepuav/io/maps/map_summary.h"

namespace deepuav {
namespace {

using Json = nlohmann::ordered_json;

const char* LensName(LensModel lens) {
  switch (lens) {
    case LensModel::kPinhole:
      return "pinhole";
    case LensModel::kRadialTangential:
      return "radial_tangential";
    case LensModel::kEquidistant:
      return "equidistant";
  }
  return "";
}

std::string SizeText(uint64_t bytes) {
  const auto size = static_cast<double>(bytes);
  if (size < 1e3) return fmt::format("{} B", bytes);
  if (size < 1e6) return fmt::format("{:.1f} kB", 1e-3 * size);
  return fmt::format("{:.1f} MB", 1e-6 * size);
}

std::string BoxText(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d size = box.isEmpty() ? Eigen::Vector3d::Zero().eval() : box.sizes();
  return fmt::format("{:.4g} x {:.4g} x {:.4g}", size.x(), size.y(), size.z());
}

std::string CameraText(const Camera& camera) {
  const Pinhole& pinhole = camera.pinhole;
  std::string text =
      fmt::format("{} {}x{}, fx {:.6g}, fy {:.6g}, cx {:.6g}, cy {:.6g}", LensName(camera.lens),
                  camera.width, camera.height, pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy);
  if (!camera.distortion.empty())
    text += fmt::format(", distortion {:.6g}", fmt::join(camera.distortion, " "));
  if (camera.rate_hz > 0) text += fmt::format(", {:.4g} Hz", camera.rate_hz);
  return text;
}

std::string SectionsText(const MapFileFacts& facts) {
  std::string text;
  for (const auto& [kind, tally] : facts.sections) {
    const std::string name = kind.substr(0, kind.find(' '));
    text += fmt::format("{}{} {} in {}", text.empty() ? "" : ", ", tally.count, name,
                        SizeText(tally.file_bytes));
  }
  return text;
}

std::string MapText(MapId id, const MapSummary& map) {
  std::string text = fmt::format("map {}: {} keyframes ({} more removed), {} landmarks\n", id.value,
                                 map.keyframes, map.removed_keyframes, map.landmarks);
  if (map.keyframes == 0) return text;
  text += fmt::format("  observations  {}, median {:.4g} a landmark; {} key points, dimension {}\n",
                      map.observations, map.median_observations, map.keypoints,
                      map.descriptor_dimension);
  text += fmt::format("  time          {:.3f} to {:.3f} s: {:.3f} s\n", map.first_time.seconds(),
                      map.last_time.seconds(), SecondsBetween(map.first_time, map.last_time));
  text += fmt::format("  extent        path {:.4g}; cameras {}; landmarks {}\n", map.path_length,
                      BoxText(map.cameras), BoxText(map.points));
  return text;
}

/// Empty where the map has none.
std::string PlaceText(const Gauge& gauge) {
  if (gauge.kind == GaugeKind::kMetric)
    return fmt::format("  metric        z up; scale to {:.2g} %\n", 100 * gauge.scale_sigma);
  if (gauge.kind != GaugeKind::kGeoreferenced) return "";
  return fmt::format("  origin        latitude {:.7f}, longitude {:.7f}, altitude {:.3f} m\n",
                     gauge.origin.latitude_deg, gauge.origin.longitude_deg,
                     gauge.origin.altitude_m);
}

Json VectorJson(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

Json BoxJson(const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return nullptr;
  return {{"min", VectorJson(box.min())}, {"max", VectorJson(box.max())}};
}

Json CameraJson(const Camera& camera) {
  return {{"model", LensName(camera.lens)}, {"width", camera.width},
          {"height", camera.height},        {"fx", camera.pinhole.fx},
          {"fy", camera.pinhole.fy},        {"cx", camera.pinhole.cx},
          {"cy", camera.pinhole.cy},        {"distortion", camera.distortion},
          {"rate_hz", camera.rate_hz}};
}

Json SectionsJson(const MapFileFacts& facts) {
  Json sections = Json::object();
  for (const auto& [kind, tally] : facts.sections) {
    sections[kind] = {{"count", tally.count},
                      {"content_bytes", tally.content_bytes},
                      {"file_bytes", tally.file_bytes}};
  }
  return sections;
}

Json OriginJson(const Gauge& gauge) {
  if (gauge.kind != GaugeKind::kGeoreferenced) return nullptr;
  return {{"latitude_deg", gauge.origin.latitude_deg},
          {"longitude_deg", gauge.origin.longitude_deg},
          {"altitude_m", gauge.origin.altitude_m}};
}

Json MapJson(MapId id, const MapSummary& map, const Gauge& gauge) {
  const bool has_keyframes = map.keyframes > 0;
  const auto if_any = [&](auto value) { return has_keyframes ? Json(value) : Json(nullptr); };
  return {{"id", id.value},
          {"keyframes", map.keyframes},
          {"removed_keyframes", map.removed_keyframes},
          {"landmarks", map.landmarks},
          {"observations", map.observations},
          {"median_observations", map.median_observations},
          {"keypoints", map.keypoints},
          {"descriptor_dimension", if_any(map.descriptor_dimension)},
          {"first_time_ns", if_any(map.first_time.nanoseconds)},
          {"last_time_ns", if_any(map.last_time.nanoseconds)},
          {"path_length", map.path_length},
          {"cameras", BoxJson(map.cameras)},
          {"points", BoxJson(map.points)},
          {"gauge", GaugeName(gauge.kind)},
          {"origin", OriginJson(gauge)}};
}

std::string OrUnknown(const std::string& text) { return text.empty() ? "unknown" : OneLine(text); }

}  // namespace

std::string MapFileText(const std::string& file, const LoadedAtlas& loaded,
                        const MapFileFacts& facts) {
  const MapOrigin& origin = loaded.origin;
  std::string text = fmt::format("{}: format {}, {}, written by deepuav {}\n", OneLine(file),
                                 facts.version, SizeText(facts.bytes), OrUnknown(origin.program));
  text += fmt::format("sections  {}\n", SectionsText(facts));
  text += fmt::format("camera    {}\n", CameraText(loaded.camera));
  text += fmt::format("features  {}\n", OrUnknown(origin.features));
  text += fmt::format("matcher   {}\n", OrUnknown(origin.matcher));
  text += fmt::format("images    {} names\n", origin.image_names.size());
  text += "lengths   in each map's own unit, metres where it is metric or has a place on Earth\n";
  for (const MapId id : loaded.atlas.Remaining()) {
    text += MapText(id, SummariseMap(loaded.atlas.At(id)));
    text += PlaceText(loaded.atlas.GaugeOf(id));
  }
  return text;
}

std::string MapFileJson(const std::string& file, const LoadedAtlas& loaded,
                        const MapFileFacts& facts) {
  Json maps = Json::array();
  for (const MapId id : loaded.atlas.Remaining())
    maps.push_back(MapJson(id, SummariseMap(loaded.atlas.At(id)), loaded.atlas.GaugeOf(id)));
  const Json json = {{"file", file},
                     {"format_version", facts.version},
                     {"bytes", facts.bytes},
                     {"program", loaded.origin.program},
                     {"features", loaded.origin.features},
                     {"matcher", loaded.origin.matcher},
                     {"image_names", loaded.origin.image_names.size()},
                     {"camera", CameraJson(loaded.camera)},
                     {"sections", SectionsJson(facts)},
                     {"maps", maps}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace deepuav
