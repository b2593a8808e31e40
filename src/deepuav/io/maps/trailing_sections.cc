#include "deepuav/io/maps/trailing_sections.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr size_t kGaugeBytes = 8 + 4 * 8, kMetricGaugeBytes = 8 + 8;
constexpr size_t kMotionNumbers = 9, kOldMotionNumbers = 6;

}  // namespace

void PutGauges(const std::map<MapId, Gauge>& gauges, ByteWriter* writer) {
  writer->Put<uint64_t>(gauges.size());
  for (const auto& [map, gauge] : gauges) {
    PutId(map, writer);
    for (double value : {gauge.origin.latitude_deg, gauge.origin.longitude_deg,
                         gauge.origin.altitude_m, gauge.scale_sigma})
      writer->Put<double>(value);
  }
}

std::map<MapId, Gauge> GetGauges(std::string_view content) {
  ByteReader reader(content, "the section of gauges");
  std::map<MapId, Gauge> gauges;
  for (size_t left = reader.GetCount(kGaugeBytes); left > 0; --left) {
    const auto map = GetId<MapId>(&reader);
    double values[4];
    reader.GetAll(std::span<double>(values));
    const Gauge gauge{GaugeKind::kGeoreferenced, {values[0], values[1], values[2]}, values[3]};
    constexpr double kPole = 90, kFullTurn = 360;
    if (!(std::abs(values[0]) <= kPole && std::abs(values[1]) <= kFullTurn &&
          std::isfinite(values[2]) && values[3] >= 0)) {
      throw Error(
          "map {} has its origin at latitude {}, longitude {}, altitude {}: expected a "
          "place on Earth",
          map.value, values[0], values[1], values[2]);
    }
    if (!gauges.emplace(map, gauge).second)
      throw Error("map {} has two gauges: expected one", map.value);
  }
  reader.ExpectEnd();
  return gauges;
}

void PutMetricGauges(const std::map<MapId, Gauge>& gauges, ByteWriter* writer) {
  writer->Put<uint64_t>(gauges.size());
  for (const auto& [map, gauge] : gauges) {
    PutId(map, writer);
    writer->Put<double>(gauge.scale_sigma);
  }
}

std::map<MapId, Gauge> GetMetricGauges(std::string_view content) {
  ByteReader reader(content, "the section of metric gauges");
  std::map<MapId, Gauge> gauges;
  for (size_t left = reader.GetCount(kMetricGaugeBytes); left > 0; --left) {
    const auto map = GetId<MapId>(&reader);
    double scale_sigma = 0;
    reader.GetAll(std::span<double>(&scale_sigma, 1));
    if (!(scale_sigma >= 0 && std::isfinite(scale_sigma))) {
      throw Error("map {} has its scale to {}: expected a standard deviation", map.value,
                  scale_sigma);
    }
    if (!gauges.emplace(map, Gauge{GaugeKind::kMetric, {}, scale_sigma}).second)
      throw Error("map {} has two gauges: expected one", map.value);
  }
  reader.ExpectEnd();
  return gauges;
}

void PutMotions(const std::map<KeyframeId, ReadoutMotion>& motions, ByteWriter* writer) {
  writer->Put<uint64_t>(motions.size());
  for (const auto& [keyframe, motion] : motions) {
    PutId(keyframe, writer);
    writer->PutAll(std::span<const double>(motion.turn_rad.data(), 3));
    writer->PutAll(std::span<const double>(motion.travel.data(), 3));
    writer->PutAll(std::span<const double>(motion.bend_rad.data(), 3));
  }
}

std::map<KeyframeId, ReadoutMotion> GetMotions(std::string_view content, bool with_bends) {
  ByteReader reader(content, "the section of rolling shutters");
  const size_t motion_bytes = 8 + 8 * (with_bends ? kMotionNumbers : kOldMotionNumbers);
  std::map<KeyframeId, ReadoutMotion> motions;
  for (size_t left = reader.GetCount(motion_bytes); left > 0; --left) {
    const auto keyframe = GetId<KeyframeId>(&reader);
    ReadoutMotion motion;
    reader.GetAll(std::span<double>(motion.turn_rad.data(), 3));
    reader.GetAll(std::span<double>(motion.travel.data(), 3));
    if (with_bends) reader.GetAll(std::span<double>(motion.bend_rad.data(), 3));
    // Nothing turns by more while an image is read.
    constexpr double kMostTurnRad = 3.2;
    const double turn_rad = std::max(motion.turn_rad.norm(), motion.bend_rad.norm());
    if (!(turn_rad <= kMostTurnRad && motion.bend_rad.allFinite() && motion.travel.allFinite())) {
      throw Error("keyframe {} turned by {} rad while it was read: expected at most {}",
                  keyframe.value, turn_rad, kMostTurnRad);
    }
    if (!motions.emplace(keyframe, motion).second)
      throw Error("keyframe {} moved twice: expected once", keyframe.value);
  }
  reader.ExpectEnd();
  return motions;
}

}  // namespace deepuav
