#include "deepuav/io/map_export.h"

#include <algorithm>

namespace deepuav {

Trajectory KeyframeTrajectory(const Map& map, KeyframeId first) {
  Trajectory trajectory;
  trajectory.reserve(static_cast<size_t>(map.KeyframeCount()));
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    if (keyframe.id < first) return;
    trajectory.push_back({keyframe.frame.time, keyframe.cam_from_world.Inverse()});
  });
  std::stable_sort(trajectory.begin(), trajectory.end(),
                   [](const TimedPose& a, const TimedPose& b) { return a.time < b.time; });
  return trajectory;
}

std::vector<ColoredPoint> LandmarkPoints(const Map& map) {
  constexpr uint8_t kGrey = 180;
  std::vector<ColoredPoint> points;
  points.reserve(static_cast<size_t>(map.LandmarkCount()));
  map.landmarks().ForEach([&](const Landmark& landmark) {
    points.push_back(ColoredPoint::Grey(landmark.position_world, kGrey));
  });
  return points;
}

}  // namespace deepuav
