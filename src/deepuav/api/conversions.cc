#include "deepuav/api/conversions.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"
#include "deepuav/io/maps/map_file.h"

namespace deepuav::api {

static_assert(static_cast<int>(LensModel::kEquidistant) ==
              static_cast<int>(core::LensModel::kEquidistant));
static_assert(static_cast<int>(GaugeKind::kGeoreferenced) ==
              static_cast<int>(core::GaugeKind::kGeoreferenced));

Vector3 ToApi(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

Pose ToApi(const SE3& pose) {
  const Eigen::Quaterniond& rotation = pose.rotation();
  return {{rotation.w(), rotation.x(), rotation.y(), rotation.z()}, ToApi(pose.translation())};
}

Camera ToApi(const core::Camera& camera) {
  const Pinhole& pinhole = camera.pinhole;
  return {camera.width,
          camera.height,
          pinhole.fx,
          pinhole.fy,
          pinhole.cx,
          pinhole.cy,
          static_cast<LensModel>(camera.lens),
          camera.distortion,
          camera.rate_hz,
          camera.readout_s};
}

Eigen::Vector3d ToCore(const Vector3& vector) { return {vector.x, vector.y, vector.z}; }

SE3 ToCore(const Pose& pose) {
  constexpr double kMostOff = 1e-3;  // As much as is rounded away where few decimals are written.
  constexpr double kUnit = 1e-12;    // What was of unit length stays what it was, to the bit.
  const Quaternion& q = pose.rotation;
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  if (!(std::abs(rotation.norm() - 1) < kMostOff))
    throw core::Error("rotation of length {}: expected 1", rotation.norm());
  const Eigen::Vector3d translation = ToCore(pose.translation);
  if (!translation.allFinite()) throw core::Error("translation: expected finite numbers");
  if (std::abs(rotation.norm() - 1) < kUnit) return SE3::FromUnit(rotation, translation);
  return {rotation, translation};
}

core::Camera ToCore(const Camera& camera) {
  core::Camera result;
  result.width = camera.width;
  result.height = camera.height;
  result.pinhole = {camera.fx, camera.fy, camera.cx, camera.cy};
  result.lens = static_cast<core::LensModel>(camera.lens);
  result.distortion = camera.distortion;
  result.rate_hz = camera.rate_hz;
  result.readout_s = camera.readout_s;
  return result;
}

Trajectory ToCore(const std::vector<TimedPose>& poses) {
  Trajectory trajectory;
  trajectory.reserve(poses.size());
  for (const TimedPose& pose : poses) {
    if (!trajectory.empty() && pose.time_ns <= trajectory.back().time.nanoseconds)
      throw core::Error("pose of time {} ns: expected poses by growing time", pose.time_ns);
    trajectory.push_back({{pose.time_ns}, ToCore(pose.world_from_camera)});
  }
  return trajectory;
}

GreyImage GreyOf(const ImageView& view) {
  const int channels = view.format == PixelFormat::kGrey8 ? 1 : 3;
  const std::ptrdiff_t row_bytes = static_cast<std::ptrdiff_t>(view.width) * channels;
  const std::ptrdiff_t stride = view.stride_bytes == 0 ? row_bytes : view.stride_bytes;
  if (!view.pixels || view.width < 1 || view.height < 1 || stride < row_bytes) {
    throw core::Error("image of {}x{} pixels with rows of {} bytes: expected pixels", view.width,
                      view.height, stride);
  }
  // OpenCV has no Mat of const pixels; these are read only.
  const cv::Mat given(view.height, view.width, CV_MAKETYPE(CV_8U, channels),
                      const_cast<std::uint8_t*>(view.pixels), static_cast<size_t>(stride));
  GreyImage grey;
  if (channels == 1) {
    grey = given.clone();
  } else {
    cv::cvtColor(given, grey,
                 view.format == PixelFormat::kBgr8 ? cv::COLOR_BGR2GRAY : cv::COLOR_RGB2GRAY);
  }
  return grey;
}

Frame FrameOf(const FrameRecord& record) {
  Frame frame;
  frame.id = record.id.value;
  frame.time_ns = record.time.nanoseconds;
  frame.reason = record.reason;
  frame.keypoints = record.keypoint_count;
  frame.landmarks = record.landmark_count;
  frame.state =
      record.state == TrackingState::kInitialising ? FrameState::kInitialising : FrameState::kLost;
  if (!record.located()) return frame;
  frame.state = record.reckoned         ? FrameState::kReckoned
                : record.inferred       ? FrameState::kInferred
                : record.tracked_online ? FrameState::kTracked
                                        : FrameState::kLocated;
  frame.map = static_cast<int>(record.map.value);
  frame.world_from_camera = ToApi(record.cam_from_world.Inverse());
  return frame;
}

std::vector<Keyframe> KeyframesOf(const Atlas& atlas, const ImageNames& names) {
  std::vector<Keyframe> keyframes;
  for (const auto& [map, number] : NumbersInFile(atlas)) {
    atlas.At(map).keyframes().ForEach([&, number = number](const core::Keyframe& keyframe) {
      const auto name = names.find(keyframe.id);
      keyframes.push_back({keyframe.id.value, keyframe.frame.time.nanoseconds,
                           static_cast<int>(number), ToApi(keyframe.cam_from_world.Inverse()),
                           name == names.end() ? std::string() : name->second});
    });
  }
  return keyframes;
}

std::vector<Landmark> LandmarksOf(const Atlas& atlas) {
  std::vector<Landmark> landmarks;
  for (const auto& [map, number] : NumbersInFile(atlas)) {
    atlas.At(map).landmarks().ForEach([&, number = number](const core::Landmark& landmark) {
      landmarks.push_back({landmark.id.value, static_cast<int>(number),
                           ToApi(landmark.position_world),
                           static_cast<int>(landmark.observations.size())});
    });
  }
  return landmarks;
}

std::vector<MapInfo> MapsOf(const Atlas& atlas) {
  std::vector<MapInfo> maps;
  for (const auto& [id, number] : NumbersInFile(atlas)) {
    const core::Map& map = atlas.At(id);
    const Gauge gauge = atlas.GaugeOf(id);
    maps.push_back({static_cast<int>(number), map.KeyframeCount(), map.LandmarkCount(),
                    static_cast<GaugeKind>(gauge.kind), gauge.scale_sigma,
                    gauge.origin.latitude_deg, gauge.origin.longitude_deg,
                    gauge.origin.altitude_m});
  }
  return maps;
}

}  // namespace deepuav::api
