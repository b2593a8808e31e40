#include "deepuav/evaluation/run_folder.h"

#include <algorithm>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/io/text_file.h"

namespace deepuav {
namespace {

constexpr size_t kMaxSummaryBytes = size_t{64} << 20;

nlohmann::ordered_json ReadSummary(const std::filesystem::path& file) {
  const std::string text = ReadBytes(file, kMaxSummaryBytes);
  try {
    nlohmann::ordered_json summary = nlohmann::ordered_json::parse(text);
    if (summary.is_object()) return summary;
  } catch (const nlohmann::json::exception& exception) {
    throw Error("{}: is no JSON: {}", file.string(), OneLine(exception.what()));
  }
  throw Error("{}: is no JSON object: expected the summary of a run", file.string());
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
