#include "arrays.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <limits>
#include <string>

namespace deepuav::python {
namespace {

constexpr std::size_t kSide = 4;
constexpr int kColours = 3;

/// Of a rotation matrix by rows of `kSide` numbers (Shepperd 1978).
api::Quaternion QuaternionOf(const double* m) {
  const double xx = m[0], yy = m[5], zz = m[10], trace = xx + yy + zz;
  api::Quaternion q;
  if (trace >= xx && trace >= yy && trace >= zz) {
    q = {1 + trace, m[9] - m[6], m[2] - m[8], m[4] - m[1]};
  } else if (xx >= yy && xx >= zz) {
    q = {m[9] - m[6], 1 + xx - yy - zz, m[1] + m[4], m[2] + m[8]};
  } else if (yy >= zz) {
    q = {m[2] - m[8], m[1] + m[4], 1 - xx + yy - zz, m[6] + m[9]};
  } else {
    q = {m[4] - m[1], m[2] + m[8], m[6] + m[9], 1 - xx - yy + zz};
  }
  const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w / length, q.x / length, q.y / length, q.z / length};
}

}  // namespace

void AppendMatrix(const api::Pose& pose, std::vector<double>* numbers) {
  const auto& [w, x, y, z] = pose.rotation;
  const api::Vector3& t = pose.translation;
  numbers->insert(
      numbers->end(),
      {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), t.x, 2 * (x * y + w * z),
       1 - 2 * (x * x + z * z), 2 * (y * z - w * x), t.y, 2 * (x * z - w * y), 2 * (y * z + w * x),
       1 - 2 * (x * x + y * y), t.z, 0, 0, 0, 1});
}

nb::ndarray<nb::numpy, double> PoseMatrix(const api::Pose& pose) {
  std::vector<double> numbers;
  AppendMatrix(pose, &numbers);
  return MakeArray(std::move(numbers), kSide, {kSide});
}

void AppendNoMatrix(std::vector<double>* numbers) {
  numbers->insert(numbers->end(), kSide * kSide, std::numeric_limits<double>::quiet_NaN());
}

api::ImageView ViewOf(const PixelArray& pixels) {
  const bool is_grey = pixels.ndim() == 2;
  if (!is_grey && !(pixels.ndim() == 3 && pixels.shape(2) == kColours))
    throw api::Error("image: expected an array of height x width or height x width x 3 bytes");
  return {pixels.data(), static_cast<int>(pixels.shape(1)), static_cast<int>(pixels.shape(0)), 0,
          is_grey ? api::PixelFormat::kGrey8 : api::PixelFormat::kRgb8};
}

api::Pose PoseOf(const double* matrix) {
  constexpr double kMostOff = 1e-3;
  api::Pose pose{QuaternionOf(matrix), {matrix[3], matrix[7], matrix[11]}};
  std::vector<double> again;
  AppendMatrix(pose, &again);
  for (std::size_t i = 0; i < again.size(); ++i) {
    if (!(std::abs(again[i] - matrix[i]) < kMostOff))
      throw api::Error("pose: expected a matrix of a rotation and a translation");
  }
  return pose;
}

std::vector<api::TimedPose> PosesOf(const TimeArray& times, const PoseArray& poses) {
  if (times.shape(0) != poses.shape(0))
    throw api::Error("poses: expected as many times as matrices");
  std::vector<api::TimedPose> result;
  for (std::size_t i = 0; i < times.shape(0); ++i)
    result.push_back({times.data()[i], PoseOf(poses.data() + i * kSide * kSide)});
  return result;
}

nb::dict KeyframeTable(const std::vector<api::Keyframe>& keyframes) {
  std::vector<std::int64_t> ids, times;
  std::vector<std::int32_t> maps;
  std::vector<double> poses;
  nb::list images;
  for (const api::Keyframe& keyframe : keyframes) {
    ids.push_back(keyframe.id);
    times.push_back(keyframe.time_ns);
    maps.push_back(keyframe.map);
    AppendMatrix(keyframe.world_from_camera, &poses);
    images.append(nb::cast(keyframe.image));
  }
  const std::size_t count = keyframes.size();
  nb::dict table;
  table["id"] = MakeArray(std::move(ids), count);
  table["time_ns"] = MakeArray(std::move(times), count);
  table["map"] = MakeArray(std::move(maps), count);
  table["world_from_camera"] = MakeArray(std::move(poses), count, {kSide, kSide});
  table["image"] = images;
  return table;
}

nb::ndarray<nb::numpy, double> PointArray(const std::vector<api::Landmark>& landmarks) {
  std::vector<double> positions;
  for (const api::Landmark& landmark : landmarks) {
    const api::Vector3& position = landmark.position_world;
    positions.insert(positions.end(), {position.x, position.y, position.z});
  }
  constexpr std::size_t kAxes = 3;
  return MakeArray(std::move(positions), landmarks.size(), {kAxes});
}

nb::dict LandmarkTable(const std::vector<api::Landmark>& landmarks) {
  std::vector<std::int64_t> ids;
  std::vector<std::int32_t> maps, observations;
  for (const api::Landmark& landmark : landmarks) {
    ids.push_back(landmark.id);
    maps.push_back(landmark.map);
    observations.push_back(landmark.observations);
  }
  const std::size_t count = landmarks.size();
  nb::dict table;
  table["id"] = MakeArray(std::move(ids), count);
  table["map"] = MakeArray(std::move(maps), count);
  table["position_world"] = PointArray(landmarks);
  table["observations"] = MakeArray(std::move(observations), count);
  return table;
}

}  // namespace deepuav::python
