#include "frame_table.h"

#include <fmt/format.h>

#include <iterator>
#include <map>
#include <string_view>

namespace deepuav {
namespace {

std::string_view StateName(const FrameRecord& record) {
  if (record.located()) return record.tracked_online ? "tracked" : "located";
  return record.state == TrackingState::kInitialising ? "initialising" : "lost";
}

std::map<FrameId, KeyframeId> KeyframesByFrame(const Atlas& atlas, const SlamResult& result) {
  std::map<FrameId, Timestamp> times;
  for (const FrameRecord& record : result.frames) times[record.id] = record.time;
  std::map<FrameId, KeyframeId> keyframes;
  for (MapId map : atlas.Remaining()) {
    atlas.At(map).keyframes().ForEach([&](const Keyframe& keyframe) {
      // A map that was loaded holds frames of an earlier run, with ids of their own.
      const auto time = times.find(keyframe.frame.id);
      if (time != times.end() && time->second == keyframe.frame.time)
        keyframes[keyframe.frame.id] = keyframe.id;
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

std::string FrameTable(const Atlas& atlas, const SlamResult& result) {
  const std::map<FrameId, KeyframeId> keyframes = KeyframesByFrame(atlas, result);
  fmt::memory_buffer table;
  const auto out = std::back_inserter(table);
  fmt::format_to(out, "frame,time_ns,state,map,key_points,landmarks,keyframe,reason\n");
  for (const FrameRecord& record : result.frames) {
    const auto keyframe = keyframes.find(record.id);
    fmt::format_to(
        out, "{},{},{},{},{},{},{},{}\n", record.id.value, record.time.nanoseconds,
        StateName(record), record.located() ? fmt::format("{}", record.map.value) : std::string(),
        record.keypoint_count, record.landmark_count,
        keyframe == keyframes.end() ? std::string() : fmt::format("{}", keyframe->second.value),
        record.reason.empty() ? std::string() : QuotedField(record.reason));
  }
  return fmt::to_string(table);
}

}  // namespace deepuav
