#include "deepuav/io/maps/map_export.h"

#include <algorithm>

namespace deepuav {

Trajectory KeyframeTrajectory(const Map& map, KeyframeId first) {
  std::vector<const Keyframe*> keyframes;
  keyframes.reserve(static_cast<size_t>(map.KeyframeCount()));
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    if (keyframe.id >= first) keyframes.push_back(&keyframe);
  });
  // Not the poses themselves: libstdc++ does not align std::stable_sort's buffer for an SE3.
  std::stable_sort(keyframes.begin(), keyframes.end(), [](const Keyframe* a, const Keyframe* b) {
    return a->frame.time < b->frame.time;
  });
  Trajectory trajectory;
  trajectory.reserve(keyframes.size());
  for (const Keyframe* keyframe : keyframes)
    trajectory.push_back({keyframe->frame.time, keyframe->cam_from_world.Inverse()});
  return trajectory;
}

std::vector<ColouredPoint> LandmarkPoints(const Map& map) {
  constexpr uint8_t kGrey = 180;
  std::vector<ColouredPoint> points;
  points.reserve(static_cast<size_t>(map.LandmarkCount()));
  map.landmarks().ForEach([&](const Landmark& landmark) {
    points.push_back(ColouredPoint::Grey(landmark.position_world, kGrey));
  });
  return points;
}

std::vector<ColouredPoint> LandmarkPointsInUtm(const Map& map, const GeoPoint& origin,
                                               const UtmZone& zone) {
  std::vector<ColouredPoint> points = LandmarkPoints(map);
  for (ColouredPoint& point : points)
    point.position = UtmFromGeo(zone, GeoFromLocal(origin, point.position));
  return points;
}

}  // namespace deepuav
