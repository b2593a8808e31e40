#include "deepuav/io/maps/map_export.h"

#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

/// As its representative observation shows it.
uint8_t GreyOf(const Map& map, const Landmark& landmark) {
  constexpr uint8_t kUnknown = 180;
  const Keyframe& keyframe = map.At(landmark.representative.keyframe);
  if (!keyframe.frame.image) return kUnknown;
  const GreyImage& image = keyframe.frame.image->image();
  const Eigen::Vector2f& px =
      keyframe.features().keypoints[static_cast<size_t>(landmark.representative.keypoint)].image_px;
  const cv::Point pixel(static_cast<int>(std::lround(px.x())),
                        static_cast<int>(std::lround(px.y())));
  return cv::Rect(cv::Point(), image.size()).contains(pixel) ? image(pixel) : kUnknown;
}

}  // namespace

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
  std::vector<ColouredPoint> points;
  points.reserve(static_cast<size_t>(map.LandmarkCount()));
  map.landmarks().ForEach([&](const Landmark& landmark) {
    points.push_back(ColouredPoint::Grey(landmark.position_world, GreyOf(map, landmark)));
  });
  return points;
}

void MoveIntoUtm(const GeoPoint& origin, const UtmZone& zone, std::vector<ColouredPoint>* points) {
  for (ColouredPoint& point : *points)
    point.position = UtmFromGeo(zone, GeoFromLocal(origin, point.position));
}

}  // namespace deepuav
