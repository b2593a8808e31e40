#include "deepuav/assembly/output/frame_table.h"

#include <fmt/format.h>

#include <array>
#include <iterator>
#include <map>
#include <optional>
#include <string_view>

#include "deepuav/io/maps/map_file.h"

namespace deepuav {
namespace {

std::string_view StateName(const FrameRecord& record) {
  if (record.reckoned) return "reckoned";
  if (record.inferred) return "inferred";
  if (record.located()) return record.tracked_online ? "tracked" : "located";
  return record.state == TrackingState::kInitialising ? "initialising" : "lost";
}

/// A map that was loaded holds keyframes of an earlier run, whose frames have ids of their own.
std::map<FrameId, KeyframeId> KeyframesByFrame(const Atlas& atlas, KeyframeId first_new) {
  std::map<FrameId, KeyframeId> keyframes;
  for (MapId map : atlas.Remaining()) {
    atlas.At(map).keyframes().ForEach([&](const Keyframe& keyframe) {
      if (keyframe.id >= first_new) keyframes[keyframe.frame.id] = keyframe.id;
    });
  }
  return keyframes;
}

/// As a CSV field; reasons hold commas.
std::string QuotedField(std::string_view text) {
  std::string quoted = "\"";
  for (char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

}  // namespace

std::string FrameTable(const Atlas& atlas, const SlamResult& result,
                       KeyframeId first_new_keyframe) {
  const std::map<FrameId, KeyframeId> keyframes = KeyframesByFrame(atlas, first_new_keyframe);
  const std::map<MapId, int64_t> numbers = NumbersInFile(atlas);
  fmt::memory_buffer table;
  const auto out = std::back_inserter(table);
  fmt::format_to(out, "frame,time_ns,state,map,key_points,landmarks,keyframe,reason\n");
  for (const FrameRecord& record : result.frames) {
    const auto keyframe = keyframes.find(record.id);
    fmt::format_to(
        out, "{},{},{},{},{},{},{},{}\n", record.id.value, record.time.nanoseconds,
        StateName(record),
        record.located() ? fmt::format("{}", numbers.at(atlas.Current(record.map))) : std::string(),
        record.keypoint_count, record.landmark_count,
        keyframe == keyframes.end() ? std::string() : fmt::format("{}", keyframe->second.value),
        record.reason.empty() ? std::string() : QuotedField(record.reason));
  }
  return fmt::to_string(table);
}

std::string PoseTable(const Atlas& atlas, const SlamResult& result) {
  constexpr std::array<std::string_view, 6> kParts = {"x", "y", "z", "rx", "ry", "rz"};
  const std::map<MapId, int64_t> numbers = NumbersInFile(atlas);
  fmt::memory_buffer table;
  const auto out = std::back_inserter(table);
  fmt::format_to(out, "frame,time_ns,map,x,y,z,qx,qy,qz,qw");
  for (size_t row = 0; row < kParts.size(); ++row) {
    for (size_t column = row; column < kParts.size(); ++column)
      fmt::format_to(out, ",cov_{}_{}", kParts[row], kParts[column]);
  }
  fmt::format_to(out, "\n");
  for (const FrameRecord& record : result.frames) {
    if (!record.located()) continue;
    const SE3 world_from_cam = record.cam_from_world.Inverse();
    const Eigen::Vector3d& p = world_from_cam.translation();
    const Eigen::Quaterniond& q = world_from_cam.rotation();
    fmt::format_to(out, "{},{},{},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}",
                   record.id.value, record.time.nanoseconds, numbers.at(atlas.Current(record.map)),
                   p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
    const std::optional<Matrix6d> covariance = PoseCovariance(record, atlas, result.covariances);
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) {
        fmt::format_to(out, ",");
        if (covariance) fmt::format_to(out, "{:.6g}", (*covariance)(row, column));
      }
    }
    fmt::format_to(out, "\n");
  }
  return fmt::to_string(table);
}

}  // namespace deepuav
