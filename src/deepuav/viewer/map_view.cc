#include "deepuav/viewer/map_view.h"

#include <algorithm>
#include <limits>

namespace deepuav {
namespace {

constexpr int kMostPoints = 30'000, kMostKeyframes = 2'000;

/// Every how many-th of so many is shown.
int Every(int count, int most) { return std::max(1, (count + most - 1) / most); }

}  // namespace

MapView ViewOf(const Map& map, KeyframeId newest) {
  MapView view;
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

MapView ViewOf(const Map& map) {
  return ViewOf(map, KeyframeId{std::numeric_limits<int64_t>::max()});
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
