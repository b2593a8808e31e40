#include "deepuav/evaluation/report/run_folder.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

constexpr size_t kMaxSummaryBytes = size_t{64} << 20;
constexpr int kDeepestNesting = 100;  // Of a summary; what goes through it calls itself.

using Json = nlohmann::ordered_json;

/// A field that the page reads. `place` may pass through every member of an object or every element
/// of an array by "*".
struct SummaryField {
  const char* place;
  bool (Json::*has_type)() const noexcept;
  const char* expected;
  bool required = false;
};

constexpr SummaryField kSummaryFields[] = {
    {"version", &Json::is_string, "a text", true},
    {"main_map", &Json::is_number_integer, "a whole number", true},
    {"dataset", &Json::is_object, "an object", true},
    {"dataset/path", &Json::is_string, "a text", true},
    {"dataset/camera_file", &Json::is_string, "a text"},
    {"schedule", &Json::is_string, "a text"},
    {"frames", &Json::is_object, "an object"},
    {"frames/*", &Json::is_number, "a number"},
    {"maps", &Json::is_array, "a list"},
    {"maps/*", &Json::is_object, "an object"},
    {"maps/*/id", &Json::is_number, "a number"},
    {"maps/*/frames", &Json::is_number, "a number"},
    {"maps/*/keyframes", &Json::is_number, "a number"},
    {"maps/*/landmarks", &Json::is_number, "a number"},
    {"maps/*/gauge", &Json::is_object, "an object"},
    {"wall_s", &Json::is_number, "a number"},
    {"peak_resident_mb", &Json::is_number, "a number"},
    {"stages", &Json::is_object, "an object"},
    {"stages/*", &Json::is_object, "an object"},
    {"stages/*/*", &Json::is_number, "a number"},
    {"options", &Json::is_object, "an object"}};

/// `rest` is what of the field's place lies below `value`.
void CheckField(const Json& value, std::string_view rest, const SummaryField& field,
                const std::string& file) {
  if (rest.empty()) {
    if ((value.*field.has_type)()) return;
    throw Error("{}: {} is {}: expected {} as in the summary of a run", file, field.place,
                Quoted(value.dump(-1, ' ', false, Json::error_handler_t::replace)), field.expected);
  }
  const size_t end = std::min(rest.find('/'), rest.size());
  const std::string key(rest.substr(0, end));
  rest.remove_prefix(std::min(end + 1, rest.size()));
  if (key == "*") {
    for (const Json& member : value) CheckField(member, rest, field, file);
  } else if (value.contains(key)) {
    CheckField(value.at(key), rest, field, file);
  } else if (field.required) {
    throw Error("{}: has no {}: expected the summary of a run", file, field.place);
  }
}

Json ReadSummary(const std::filesystem::path& file) {
  const std::string text = ReadBytes(file, kMaxSummaryBytes);
  Json summary;
  try {
    summary = Json::parse(text, [&](int depth, Json::parse_event_t, const Json&) {
      if (depth > kDeepestNesting) {
        throw Error("{}: is nested more than {} deep: expected the summary of a run", file.string(),
                    kDeepestNesting);
      }
      return true;
    });
  } catch (const nlohmann::json::exception& exception) {
    const std::string reason = OneLine(exception.what());  // "[json.exception...] what is wrong"
    const size_t prefix = reason.find("] ");
    throw Error("{}: is no JSON: {}", file.string(),
                prefix == std::string::npos ? reason : reason.substr(prefix + 2));
  }
  if (!summary.is_object())
    throw Error("{}: is no JSON object: expected the summary of a run", file.string());
  for (const SummaryField& field : kSummaryFields)
    CheckField(summary, field.place, field, file.string());
  return summary;
}

/// The poses of a file that may hold none.
Trajectory ReadPoses(const std::filesystem::path& file) {
  if (TextFile(file).lines().empty()) return {};
  return ReadTrajectory(file);
}

std::vector<std::pair<std::string, std::vector<double>>> ReadTimings(
    const std::filesystem::path& file) {
  std::vector<std::pair<std::string, std::vector<double>>> stages;
  const TextFile text(file);
  std::vector<std::string_view> fields;
  for (size_t i = 1; i < text.lines().size(); ++i) {
    const std::string where = text.Where(text.lines()[i]);
    SplitAtCommas(text.lines()[i].text, &fields);
    if (fields.size() != 3) {
      throw Error("{}: {} fields: expected 3 (stage,call,milliseconds)", where, fields.size());
    }
    if (stages.empty() || stages.back().first != fields[0]) stages.emplace_back(fields[0], 0);
    stages.back().second.push_back(ParseFinite(fields[2], where, "milliseconds"));
  }
  return stages;
}

/// A reason as frames share it: with N for every number.
std::string WithoutNumbers(std::string_view reason) {
  std::string shared;
  bool in_number = false;
  for (const char c : reason) {
    const bool is_digit = c >= '0' && c <= '9';
    if (!is_digit && c != '"') shared += c;
    if (is_digit && !in_number) shared += 'N';
    in_number = is_digit;
  }
  return shared;
}

int64_t ParseFrame(std::string_view text, const std::string& where) {
  constexpr double kLargest = 1e15;
  const double number = ParseFinite(text, where, "the frame's number");
  if (number < 0 || number > kLargest || number != std::floor(number)) {
    throw Error("{}: the frame's number is {}: expected a whole number from 0 on", where,
                Quoted(text));
  }
  return static_cast<int64_t>(number);
}

/// The columns of frames.csv that are read: frame,time_ns,state,map,key_points,landmarks,keyframe
/// and the reason, which is quoted and may hold commas.
std::vector<LostFrames> ReadLostFrames(const std::filesystem::path& file) {
  constexpr size_t kState = 2, kReason = 7;
  const TextFile text(file);
  std::vector<LostFrames> lost;
  std::vector<std::string_view> fields;
  for (size_t i = 1; i < text.lines().size(); ++i) {
    const TextLine& line = text.lines()[i];
    SplitAtCommas(line.text, &fields);
    if (fields.size() <= kReason) {
      throw Error("{}: {} fields: expected {} (frame to reason)", text.Where(line), fields.size(),
                  kReason + 1);
    }
    if (fields[kState] != "lost" && fields[kState] != "initialising") continue;
    std::string reason = "no reason was noted";
    if (!fields[kReason].empty()) {
      reason = WithoutNumbers(
          line.text.substr(static_cast<size_t>(fields[kReason].data() - line.text.data())));
    }
    const int64_t frame = ParseFrame(fields[0], text.Where(line));
    auto known = std::find_if(lost.begin(), lost.end(),
                              [&](const LostFrames& one) { return one.reason == reason; });
    if (known == lost.end()) known = lost.insert(lost.end(), {reason, 0, frame, frame});
    ++known->count;
    known->last = frame;
  }
  std::stable_sort(lost.begin(), lost.end(),
                   [](const LostFrames& a, const LostFrames& b) { return a.count > b.count; });
  return lost;
}

}  // namespace

std::string RunFolder::Text(const std::string& pointer) const {
  const nlohmann::ordered_json::json_pointer place(pointer);
  if (!summary.contains(place)) return "";
  const nlohmann::ordered_json& value = summary.at(place);
  return value.is_string() ? value.get<std::string>() : value.dump();
}

RunFolder ReadRunFolder(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path))
    throw Error("{}: is no folder: expected the output folder of a run", path.string());
  RunFolder run;
  run.path = std::filesystem::absolute(path).lexically_normal();
  if (!run.path.has_filename()) run.path = run.path.parent_path();
  run.name = run.path.filename().string();
  run.summary = ReadSummary(path / "summary.json");
  run.trajectory = ReadPoses(path / "trajectory.txt");
  if (std::filesystem::exists(path / "keyframes.txt"))
    run.keyframes = ReadPoses(path / "keyframes.txt");
  if (std::filesystem::exists(path / "timings.csv"))
    run.stage_ms = ReadTimings(path / "timings.csv");
  if (std::filesystem::exists(path / "frames.csv")) run.lost = ReadLostFrames(path / "frames.csv");
  if (std::filesystem::exists(path / "points.ply")) run.points = ReadPly(path / "points.ply");
  return run;
}

void MakeNamesUnique(std::vector<RunFolder>* runs) {
  constexpr int kMostParents = 8;
  for (int parents = 1; parents <= kMostParents; ++parents) {
    std::map<std::string, int> uses;
    for (const RunFolder& run : *runs) ++uses[run.name];
    for (RunFolder& run : *runs) {
      if (uses[run.name] == 1) continue;
      std::filesystem::path parent = run.path;
      for (int i = 0; i < parents; ++i) parent = parent.parent_path();
      if (parent.has_filename()) run.name = parent.filename().string() + "/" + run.name;
    }
  }
}

}  // namespace deepuav
