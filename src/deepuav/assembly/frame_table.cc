#include "deepuav/assembly/frame_table.h"

#include <fmt/format.h>

#include <iterator>
#include <map>
#include <string_view>

#include "deepuav/io/map_file.h"

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

}  // namespace deepuav
