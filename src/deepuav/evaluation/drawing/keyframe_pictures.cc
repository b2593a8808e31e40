#include "deepuav/evaluation/drawing/keyframe_pictures.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/evaluation/drawing/packed_array.h"

namespace deepuav {
namespace {

/// As they were made: flights of one map may have the same times.
std::vector<const Keyframe*> InOrder(const Map& map) {
  std::vector<const Keyframe*> keyframes;
  map.keyframes().ForEach([&](const Keyframe& keyframe) { keyframes.push_back(&keyframe); });
  std::sort(keyframes.begin(), keyframes.end(),
            [](const Keyframe* a, const Keyframe* b) { return a->id < b->id; });
  return keyframes;
}

/// A JPEG as data URI; empty where the dataset does not have the frame, or one of another name.
std::string ImageUri(Dataset* dataset, Timestamp time, const std::string& name,
                     const PictureOptions& options) {
  const std::optional<int> frame = FrameAt(*dataset, time);
  if (!frame || (!name.empty() && dataset->ImageName(*frame) != name)) return "";
  cv::Mat image;
  try {
    image = dataset->Load(*frame);
  } catch (const Error&) {  // The page shows the key points alone.
    return "";
  }
  if (image.cols > options.width_px) {
    const double ratio = static_cast<double>(options.width_px) / image.cols;
    cv::resize(image, image, {}, ratio, ratio, cv::INTER_AREA);
  }
  std::vector<uint8_t> jpeg;
  cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, options.jpeg_quality});
  return "data:image/jpeg;base64," +
         Base64({reinterpret_cast<const char*>(jpeg.data()), jpeg.size()});
}

uint16_t ToShort(float value, int limit) {
  return static_cast<uint16_t>(std::lround(std::clamp(value, 0.0f, static_cast<float>(limit))));
}

nlohmann::json View(const Keyframe& keyframe, const Camera& camera, const ImageNames& image_names,
                    Dataset* dataset, const PictureOptions& options) {
  std::vector<uint16_t> points;
  std::vector<uint8_t> mapped;
  const std::vector<Keypoint>& keypoints = keyframe.features().keypoints;
  for (size_t i = 0; i < keypoints.size(); ++i) {
    points.push_back(ToShort(keypoints[i].image_px.x(), camera.width));
    points.push_back(ToShort(keypoints[i].image_px.y(), camera.height));
    mapped.push_back(keyframe.landmarks[i].valid() ? 1 : 0);
  }
  nlohmann::json view = {{"time_s", keyframe.frame.time.seconds()},
                         {"keyframe", keyframe.id.value},
                         {"width", camera.width},
                         {"height", camera.height},
                         {"points", PackShorts(points)},
                         {"mapped", PackBytes(mapped)}};
  if (dataset) {
    const auto name = image_names.find(keyframe.id);
    const std::string image = ImageUri(dataset, keyframe.frame.time,
                                       name == image_names.end() ? "" : name->second, options);
    if (!image.empty()) view["image"] = image;
  }
  return view;
}

/// The key points of the two that show the same landmarks, by turns.
std::vector<uint16_t> SharedKeypoints(const Map& map, const Keyframe& first,
                                      const Keyframe& second) {
  std::vector<uint16_t> matches;
  for (size_t i = 0; i < first.landmarks.size(); ++i) {
    if (!first.landmarks[i].valid()) continue;
    for (const Observation& observation : map.At(first.landmarks[i]).observations) {
      if (observation.keyframe != second.id) continue;
      matches.push_back(static_cast<uint16_t>(i));
      matches.push_back(static_cast<uint16_t>(observation.keypoint));
    }
  }
  return matches;
}

}  // namespace

void PictureOptions::Check() const { CheckOptions("", *this); }

nlohmann::json KeyframePictures(const Map& map, const Camera& camera, const ImageNames& image_names,
                                Dataset* dataset, const PictureOptions& options) {
  options.Check();
  const std::vector<const Keyframe*> keyframes = InOrder(map);
  nlohmann::json pictures = nlohmann::json::array();
  if (keyframes.size() < 2) return pictures;
  const size_t possible = keyframes.size() - 1;
  const size_t count = std::min<size_t>(static_cast<size_t>(options.pairs), possible);
  for (size_t i = 0; i < count; ++i) {
    const size_t at = (2 * i + 1) * possible / (2 * count);
    const Keyframe &first = *keyframes[at], &second = *keyframes[at + 1];
    const std::vector<uint16_t> matches = SharedKeypoints(map, first, second);
    pictures.push_back({{"shared", matches.size() / 2},
                        {"matches", PackShorts(matches)},
                        {"views",
                         {View(first, camera, image_names, dataset, options),
                          View(second, camera, image_names, dataset, options)}}});
  }
  return pictures;
}

}  // namespace deepuav
