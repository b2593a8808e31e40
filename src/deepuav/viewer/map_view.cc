#include "deepuav/viewer/map_view.h"

#include <algorithm>
#include <limits>

namespace deepuav {
namespace {

constexpr int kMostPoints = 30'000, kMostKeyframes = 2'000, kMostLoops = 500;

/// Every how many-th of so many is shown.
int Every(int count, int most) { return std::max(1, (count + most - 1) / most); }

/// A world of the camera alone starts as the one of its first keyframe, whose y runs down.
Eigen::Vector3f UpIn(GaugeKind gauge) {
  return gauge == GaugeKind::kFree ? Eigen::Vector3f(0, -1, 0) : Eigen::Vector3f(0, 0, 1);
}

Eigen::Vector3f PlaceOf(const Keyframe& keyframe) {
  return keyframe.cam_from_world.Inverse().translation().cast<float>();
}

std::vector<std::array<Eigen::Vector3f, 2>> LoopsOf(const Map& map, KeyframeId newest) {
  std::vector<std::array<Eigen::Vector3f, 2>> all, shown;
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    for (const KeyframeId other : keyframe.loops) {
      if (other < keyframe.id && keyframe.id <= newest)
        all.push_back({PlaceOf(map.At(other)), PlaceOf(keyframe)});
    }
  });
  const auto every = static_cast<size_t>(Every(static_cast<int>(all.size()), kMostLoops));
  for (size_t i = 0; i < all.size(); i += every) shown.push_back(all[i]);
  return shown;
}

}  // namespace

MapView ViewOf(const Map& map, GaugeKind gauge, KeyframeId newest) {
  MapView view;
  view.up = UpIn(gauge);
  view.loops = LoopsOf(map, newest);
  view.map = map.id().value;
  const int every_point = Every(map.LandmarkCount(), kMostPoints);
  map.landmarks().ForEach([&](const Landmark& landmark) {
    if (landmark.created_by > newest) return;
    if (view.landmarks++ % every_point == 0)
      view.points.push_back(landmark.position_world.cast<float>());
  });
  const int every_keyframe = Every(map.KeyframeCount(), kMostKeyframes);
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    if (keyframe.id > newest) return;
    if (view.keyframes++ % every_keyframe == 0)
      view.world_from_keyframes.push_back(keyframe.cam_from_world.Inverse());
  });
  return view;
}

MapView ViewOf(const Map& map, GaugeKind gauge) {
  return ViewOf(map, gauge, KeyframeId{std::numeric_limits<int64_t>::max()});
}

MapView ViewOf(const MapSketch& sketch) {
  MapView view;
  view.map = sketch.map.value;
  view.landmarks = static_cast<int>(sketch.points_world.size());
  view.keyframes = static_cast<int>(sketch.cam_from_world.size());
  const auto every_point = static_cast<size_t>(Every(view.landmarks, kMostPoints));
  for (size_t i = 0; i < sketch.points_world.size(); i += every_point)
    view.points.push_back(sketch.points_world[i].cast<float>());
  const auto every_keyframe = static_cast<size_t>(Every(view.keyframes, kMostKeyframes));
  for (size_t i = 0; i < sketch.cam_from_world.size(); i += every_keyframe)
    view.world_from_keyframes.push_back(sketch.cam_from_world[i].Inverse());
  return view;
}

}  // namespace deepuav
