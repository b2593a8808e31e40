#include "deepuav/system/sensors/placed_maps.h"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "deepuav/base/logging.h"
#include "deepuav/base/median.h"

namespace deepuav {
namespace {

/// Standard deviation of where a map's landmarks lie on Earth, in their median; metres.
double PlaceSigma(const Map& map, const Georeference& found) {
  const Sim3 world_from_local = found.local_from_world.Inverse();
  std::vector<double> sigmas_m;
  map.landmarks().ForEach([&](const Landmark& landmark) {
    const Eigen::Vector3d as_found = world_from_local * landmark.position_world;
    sigmas_m.push_back(std::sqrt(found.PositionCovariance(as_found).trace()));
  });
  return sigmas_m.empty() ? std::numeric_limits<double>::infinity() : Median(sigmas_m);
}

/// The keyframes of two maps that were nearest to one another.
LoopTie NearestKeyframes(const Map& map, const Map& into) {
  std::vector<std::pair<KeyframeId, Eigen::Vector3d>> places;
  into.keyframes().ForEach([&](const Keyframe& keyframe) {
    places.emplace_back(keyframe.id, keyframe.cam_from_world.InverseTranslation());
  });
  LoopTie nearest;
  double least_m = std::numeric_limits<double>::infinity();
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    const Eigen::Vector3d centre = keyframe.cam_from_world.InverseTranslation();
    for (const auto& [place, position] : places) {
      const double apart_m = (position - centre).norm();
      if (apart_m >= least_m) continue;
      least_m = apart_m;
      nearest = {keyframe.id, place, {}};
    }
  });
  return nearest;
}

double CommonRms(double a, int of_a, double b, int of_b) {
  return std::sqrt((of_a * a * a + of_b * b * b) / (of_a + of_b));
}

/// What is told of a map holds of both.
void TakeReport(const GeoreferenceReport& other, GeoreferenceReport* report) {
  report->horizontal_rms_m =
      CommonRms(report->horizontal_rms_m, report->used, other.horizontal_rms_m, other.used);
  report->vertical_rms_m =
      CommonRms(report->vertical_rms_m, report->used, other.vertical_rms_m, other.used);
  report->fixes += other.fixes;
  report->used += other.used;
  report->height_steps += other.height_steps;
  const auto append = [](const auto& from, auto* to) {
    to->insert(to->end(), from.begin(), from.end());
  };
  append(other.factors.positions, &report->factors.positions);
  append(other.factors.height_steps, &report->factors.height_steps);
  append(other.factors.levels, &report->factors.levels);
  append(other.factors.distances, &report->factors.distances);
}

}  // namespace

int JoinPlacedMaps(double max_sigma_m, std::map<MapId, GeoreferenceReport>* reports, Mapper* mapper,
                   Atlas* atlas) {
  int joined = 0;
  MapId known;
  for (const MapId map : atlas->BySize()) {
    const auto placed = reports->find(map);
    if (placed == reports->end() || !placed->second.found) continue;
    const double sigma_m = PlaceSigma(atlas->At(map), *placed->second.found);
    if (!(sigma_m <= max_sigma_m)) {
      Log().info("map {} stays one of its own: its fixes tell its place to {:.1f} m", map.value,
                 sigma_m);
      continue;
    }
    if (!known.valid()) {
      known = map;
      continue;
    }
    Log().info("maps {} and {} are one by their fixes", known.value, map.value);
    GeoreferenceReport common = std::move(reports->at(known));
    TakeReport(placed->second, &common);
    reports->erase(known), reports->erase(map);
    const LoopTie tie = NearestKeyframes(atlas->At(map), atlas->At(known));
    mapper->Join({map, known, Sim3(), {}, {tie}});
    known = atlas->Current(known);
    (*reports)[known] = std::move(common);
    ++joined;
  }
  return joined;
}

}  // namespace deepuav
