#include "deepuav/viewer/view_messages.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace deepuav {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr int kMostWidth = 480;
constexpr int kJpegQuality = 60;
constexpr float kShares = 65535;

template <typename Number>
void Append(Number number, std::string* bytes) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &number, sizeof(Number));
  bytes->append(raw, sizeof(Number));
}

std::string WithHeader(const nlohmann::json& header) {
  const std::string text = header.dump();
  std::string bytes;
  Append(static_cast<uint32_t>(text.size()), &bytes);
  return bytes + text;
}

uint16_t Share(float value, float low, float size) {
  if (!(size > 0)) return 0;
  return static_cast<uint16_t>(std::lround(std::clamp((value - low) / size, 0.F, 1.F) * kShares));
}

std::vector<uchar> Jpeg(const GreyImage& image) {
  GreyImage small = image;
  if (image.cols > kMostWidth) {
    small = GreyImage();
    const double scale = static_cast<double>(kMostWidth) / image.cols;
    cv::resize(image, small, cv::Size(), scale, scale, cv::INTER_AREA);
  }
  std::vector<uchar> jpeg;
  cv::imencode(".jpg", small, jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  return jpeg;
}

}  // namespace

std::string PictureMessage(const FrameView& frame) {
  std::string bytes = WithHeader({{"kind", "picture"},
                                  {"frame", frame.id.value},
                                  {"width", frame.width_px},
                                  {"height", frame.height_px},
                                  {"points", frame.landmarks_px.size()}});
  for (const Eigen::Vector2f& px : frame.landmarks_px) {
    Append(Share(px.x(), 0, static_cast<float>(frame.width_px)), &bytes);
    Append(Share(px.y(), 0, static_cast<float>(frame.height_px)), &bytes);
  }
  const std::vector<uchar> jpeg = Jpeg(frame.image);
  return bytes.append(reinterpret_cast<const char*>(jpeg.data()), jpeg.size());
}

std::string MapMessage(const MapView& map) {
  Eigen::Vector3f low = Eigen::Vector3f::Zero(), high = Eigen::Vector3f::Zero();
  if (!map.points.empty()) low = high = map.points.front();
  for (const Eigen::Vector3f& point : map.points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Eigen::Vector3f size = high - low;
  const auto numbers = [](const Eigen::Vector3f& v) { return nlohmann::json{v.x(), v.y(), v.z()}; };
  std::string bytes = WithHeader({{"kind", "map"},
                                  {"map", map.map},
                                  {"up", numbers(map.up)},
                                  {"points", map.points.size()},
                                  {"keyframes", map.world_from_keyframes.size()},
                                  {"path", map.path.size()},
                                  {"loops", map.loops.size()},
                                  {"low", numbers(low)},
                                  {"size", numbers(size)}});
  for (const Eigen::Vector3f& point : map.points) {
    for (int axis = 0; axis < 3; ++axis) Append(Share(point[axis], low[axis], size[axis]), &bytes);
  }
  for (const SE3& pose : map.world_from_keyframes) {
    for (const double value : pose.translation()) Append(static_cast<float>(value), &bytes);
    for (const double value : pose.rotation().coeffs()) Append(static_cast<float>(value), &bytes);
  }
  const auto append = [&bytes](const Eigen::Vector3f& point) {
    for (const float value : point) Append(value, &bytes);
  };
  for (const Eigen::Vector3f& point : map.path) append(point);
  for (const auto& ends : map.loops) std::for_each(ends.begin(), ends.end(), append);
  return bytes;
}

nlohmann::json PoseJson(const SE3& world_from_cam) {
  nlohmann::json json = nlohmann::json::array();
  for (const double value : world_from_cam.translation()) json.push_back(value);
  for (const double value : world_from_cam.rotation().coeffs()) json.push_back(value);
  return json;
}

}  // namespace deepuav
