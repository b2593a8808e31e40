#include "deepuav/viewer/recorded_frames.h"

#include <fmt/format.h>

#include <charconv>
#include <map>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/geodata/trajectory.h"

namespace deepuav {
namespace {

constexpr const char* kHeader = "frame,time_ns,state,map,key_points,landmarks,keyframe,reason";
constexpr size_t kFieldsBeforeReason = 7;

/// The fields before the last one, in which alone commas may stand, and that one.
std::vector<std::string> Fields(const std::string& line) {
  std::vector<std::string> fields;
  size_t begin = 0;
  while (fields.size() < kFieldsBeforeReason) {
    const size_t comma = line.find(',', begin);
    if (comma == std::string::npos) return {};
    fields.push_back(line.substr(begin, comma - begin));
    begin = comma + 1;
  }
  fields.push_back(line.substr(begin));
  return fields;
}

std::string Unquoted(const std::string& field) {
  if (field.size() < 2 || field.front() != '"' || field.back() != '"') return field;
  std::string text;
  for (size_t i = 1; i + 1 < field.size(); ++i) {
    if (field[i] == '"' && field[i + 1] == '"') ++i;
    text += field[i];
  }
  return text;
}

int64_t Number(const std::string& field, int64_t if_empty, const std::string& where) {
  if (field.empty()) return if_empty;
  int64_t value = 0;
  const auto [end, status] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (status != std::errc() || end != field.data() + field.size())
    throw Error("{}: found '{}': expected a whole number", where, field);
  return value;
}

RecordedFrame ParseFrame(const std::string& line, const std::string& where) {
  const std::vector<std::string> fields = Fields(line);
  if (fields.empty()) throw Error("{}: expected the fields {}", where, kHeader);
  RecordedFrame frame;
  frame.id = {Number(fields[0], -1, where)};
  frame.time = {Number(fields[1], 0, where)};
  const bool has_pose_at_end =
      fields[2] == "located" || fields[2] == "reckoned" || fields[2] == "inferred";
  frame.state = has_pose_at_end ? "tracked" : fields[2];
  frame.map = Number(fields[3], -1, where);
  frame.key_points = static_cast<int>(Number(fields[4], 0, where));
  frame.landmarks = static_cast<int>(Number(fields[5], 0, where));
  frame.keyframe = {Number(fields[6], -1, where)};
  frame.reason = Unquoted(fields[7]);
  return frame;
}

std::vector<RecordedFrame> ReadFrames(const std::filesystem::path& name) {
  const TextFile file(name);
  std::vector<RecordedFrame> frames;
  for (const TextLine& line : file.lines()) {
    if (&line != &file.lines().front()) {
      frames.push_back(ParseFrame(std::string(line.text), file.Where(line)));
    } else if (line.text != kHeader) {
      throw Error("{}: found {}: expected {}", file.Where(line), Quoted(line.text), kHeader);
    }
  }
  return frames;
}

}  // namespace

std::vector<RecordedFrame> ReadRecordedFrames(const std::filesystem::path& folder,
                                              int64_t main_map) {
  std::vector<RecordedFrame> frames = ReadFrames(folder / "frames.csv");
  std::set<int64_t> maps;
  for (const RecordedFrame& frame : frames) {
    if (frame.map >= 0) maps.insert(frame.map);
  }
  for (const int64_t map : maps) {
    const std::string name =
        map == main_map ? "trajectory.txt" : fmt::format("trajectory-map-{}.txt", map);
    std::map<Timestamp, SE3> poses;
    for (const TimedPose& pose : ReadTrajectory(folder / name))
      poses.emplace(pose.time, pose.world_from_cam);
    for (RecordedFrame& frame : frames) {
      const auto pose = frame.map == map ? poses.find(frame.time) : poses.end();
      if (pose != poses.end()) frame.world_from_cam = pose->second;
    }
  }
  return frames;
}

}  // namespace deepuav
