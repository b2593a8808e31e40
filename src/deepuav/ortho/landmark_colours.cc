#include "deepuav/ortho/landmark_colours.h"

#include <cmath>
#include <map>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

/// A point of the cloud, and the key point that shows it best.
struct ShownPoint {
  size_t point = 0;
  int keypoint = 0;
};

std::map<KeyframeId, std::vector<ShownPoint>> PointsByImage(const Map& map) {
  std::map<KeyframeId, std::vector<ShownPoint>> shown;
  size_t point = 0;
  map.landmarks().ForEach([&](const Landmark& landmark) {
    const Observation& best = landmark.representative;
    shown[best.keyframe].push_back({point++, best.keypoint});
  });
  return shown;
}

void ColourFrom(const cv::Mat3b& image, const Features& features,
                const std::vector<ShownPoint>& shown, std::vector<ColouredPoint>* points) {
  for (const auto& [point, keypoint] : shown) {
    const Eigen::Vector2f& px = features.keypoints[static_cast<size_t>(keypoint)].image_px;
    const cv::Point pixel(static_cast<int>(std::lround(px.x())),
                          static_cast<int>(std::lround(px.y())));
    if (!cv::Rect(cv::Point(), image.size()).contains(pixel)) continue;
    const cv::Vec3b& bgr = image(pixel);
    (*points)[point].rgb = {bgr[2], bgr[1], bgr[0]};
  }
}

}  // namespace

void ColourPoints(const Map& map, const Camera& camera, Photographs* photographs,
                  const std::function<void(const std::string& why)>& unreadable,
                  std::vector<ColouredPoint>* points) {
  const std::map<KeyframeId, std::vector<ShownPoint>> by_image = PointsByImage(map);
  int view = 0;
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    const int number = view++;
    const auto shown = by_image.find(keyframe.id);
    if (shown == by_image.end()) return;
    try {
      ColourFrom(photographs->Load(number, {camera.width, camera.height}), keyframe.features(),
                 shown->second, points);
    } catch (const Error& error) {
      unreadable(error.what());
    }
  });
}

}  // namespace deepuav
