#include "deepuav/evaluation/report/run_report.h"

#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/evaluation/drawing/packed_array.h"
#include "deepuav/evaluation/report/evaluation_report.h"
#include "deepuav/io/maps/map_file.h"
#include "deepuav/sensors/lever_arm.h"

namespace deepuav {
namespace {

using Json = nlohmann::ordered_json;

/// Seconds since `start` on the truth's clock.
std::vector<float> Seconds(const Trajectory& trajectory, Timestamp start, double offset_s) {
  std::vector<float> seconds;
  seconds.reserve(trajectory.size());
  for (const TimedPose& pose : trajectory) {
    seconds.push_back(static_cast<float>(SecondsBetween(start, pose.time) + offset_s));
  }
  return seconds;
}

std::vector<float> Coordinates(const Trajectory& trajectory) {
  std::vector<float> coordinates;
  coordinates.reserve(3 * trajectory.size());
  for (const TimedPose& pose : trajectory) {
    for (const double value : pose.world_from_cam.translation()) {
      coordinates.push_back(static_cast<float>(value));
    }
  }
  return coordinates;
}

std::vector<float> Floats(const std::vector<double>& values) {
  return {values.begin(), values.end()};
}

Json PathJson(const Trajectory& trajectory, Timestamp start, double offset_s) {
  return {{"t", PackFloats(Seconds(trajectory, start, offset_s))},
          {"p", PackFloats(Coordinates(trajectory))}};
}

/// Quaternions x y z w of the camera in the world, for drawing it.
std::vector<float> Orientations(const Trajectory& trajectory) {
  std::vector<float> numbers;
  for (const TimedPose& pose : trajectory) {
    for (const double value : pose.world_from_cam.rotation().coeffs()) {
      numbers.push_back(static_cast<float>(value));
    }
  }
  return numbers;
}

Json RelativeErrorsJson(const Evaluation& evaluation, Timestamp start) {
  if (!evaluation.rpe) return nullptr;
  const RelativeError& rpe = *evaluation.rpe;
  std::vector<float> seconds;
  for (const auto& [from, to] : rpe.pairs) {
    seconds.push_back(static_cast<float>(SecondsBetween(start, evaluation.matched_truth[to].time)));
  }
  return {{"t", PackFloats(seconds)},
          {"translation_m", PackFloats(Floats(rpe.errors_m))},
          {"rotation_deg", PackFloats(Floats(rpe.errors_deg))}};
}

Json EvaluationSection(const RunReport& report) {
  const Evaluation& evaluation = *report.evaluation;
  nlohmann::json figures = EvaluationJson(evaluation, report.options);
  figures.erase("per_pose");
  const Timestamp start = report.Start();
  return {{"source", report.truth_source},
          {"figures", figures},
          {"z_is_up", evaluation.z_is_up},
          {"truth", PathJson(evaluation.truth, start, 0)},
          {"matched", PathJson(evaluation.matched_estimate, start, evaluation.time_offset_s)},
          {"matched_truth", PathJson(evaluation.matched_truth, start, 0)},
          {"error_m", PackFloats(Floats(evaluation.ate.errors_m))},
          {"relative", RelativeErrorsJson(evaluation, start)}};
}

Json CloudJson(const RunReport& report, int max_points) {
  const Sim3 world_from_map = report.WorldFromMap();
  const std::vector<ColouredPoint>& all = report.run.points;
  const size_t kept = std::min(all.size(), static_cast<size_t>(max_points));
  std::vector<Eigen::Vector3f> points;
  std::vector<uint8_t> colours;
  bool is_coloured = false;
  for (size_t i = 0; i < kept; ++i) {
    const ColouredPoint& point = all[i * all.size() / kept];
    points.emplace_back((world_from_map * point.position).cast<float>());
    colours.insert(colours.end(), point.rgb.begin(), point.rgb.end());
    is_coloured |= point.rgb[0] != point.rgb[1] || point.rgb[1] != point.rgb[2];
  }
  Json cloud = PackPoints(points);
  cloud["count"] = kept;
  cloud["total"] = all.size();
  if (is_coloured) cloud["rgb"] = PackBytes(colours);
  return cloud;
}

Json GrowthJson(const RunReport& report) {
  const double offset_s = report.evaluation ? report.evaluation->time_offset_s : 0;
  std::vector<float> seconds;
  for (const Timestamp time : report.growth.times) {
    seconds.push_back(static_cast<float>(SecondsBetween(report.Start(), time) + offset_s));
  }
  return {
      {"t", PackFloats(seconds)},
      {"landmarks", PackFloats({report.growth.landmarks.begin(), report.growth.landmarks.end()})}};
}

Json StagesJson(const RunFolder& run) {
  Json stages = Json::array();
  for (const auto& [name, ms] : run.stage_ms) {
    stages.push_back({{"name", name}, {"ms", PackFloats(Floats(ms))}});
  }
  return stages;
}

Json LostJson(const RunFolder& run) {
  Json reasons = Json::array();
  for (const LostFrames& lost : run.lost) {
    reasons.push_back({{"reason", lost.reason},
                       {"frames", lost.count},
                       {"first", lost.first},
                       {"last", lost.last}});
  }
  return reasons;
}

/// The dataset of the run, if it is still where it was, with the camera that the run was given.
std::unique_ptr<Dataset> DatasetOf(const RunFolder& run) {
  const std::filesystem::path path = run.Text("/dataset/path");
  if (path.empty() || !std::filesystem::exists(path)) return nullptr;
  try {
    return OpenDataset(path, {run.Text("/dataset/camera_file")});
  } catch (const Error& error) {
    Log().warn("{}: no pictures: {}", run.name, error.what());
    return nullptr;
  }
}

void AddSurvey(const LoadedAtlas& loaded, MapId map, std::unique_ptr<Dataset> dataset,
               RunReport* report) {
  if (report->run.Text("/dataset/kind") != "photographs") return;
  try {
    report->survey = SurveyPictures(loaded, map, std::move(dataset));
  } catch (const Error& error) {
    Log().warn("{}: no survey from above: {}", report->run.name, error.what());
  }
}

}  // namespace

Timestamp RunReport::Start() const {
  if (evaluation) return evaluation->truth.front().time;
  return run.trajectory.empty() ? Timestamp{} : run.trajectory.front().time;
}

void Evaluate(const std::filesystem::path& truth, const EvaluationOptions& options,
              const TruthOptions& truth_options, RunReport* report) {
  report->options = options;
  if (report->run.trajectory.empty()) {
    report->problem = "the run has no poses";
    return;
  }
  const std::filesystem::path source =
      truth.empty() ? std::filesystem::path(report->run.Text("/dataset/path")) : truth;
  try {
    if (truth.empty() && (source.empty() || !std::filesystem::exists(source))) {
      report->problem = "no truth was given, and the dataset is no longer there";
      return;
    }
    if (truth.empty() && !std::filesystem::is_directory(source)) {
      report->problem = "no truth was given, and a video holds none";
      return;
    }
    report->evaluation =
        EvaluateTrajectory(LoadTruth(source, truth_options), report->run.trajectory, options);
    report->truth_source = source.string();
  } catch (const Error& error) {
    if (!truth.empty()) throw;
    report->problem = error.what();
  }
}

void AddMap(const PictureOptions& options, RunReport* report) {
  const std::filesystem::path file = report->run.path / "map.deepuav";
  const std::string main_map = report->run.Text("/main_map");
  if (!std::filesystem::exists(file) || main_map.empty() || report->run.trajectory.empty()) return;
  try {
    const LoadedAtlas loaded = ReadMapFile(file);
    const Map& map = loaded.atlas.At({std::stoll(main_map)});
    report->growth = GrowthOf(map);
    std::unique_ptr<Dataset> dataset = DatasetOf(report->run);
    report->pictures =
        KeyframePictures(map, loaded.camera, loaded.origin.image_names, dataset.get(), options);
    AddSurvey(loaded, map.id(), std::move(dataset), report);
  } catch (const std::exception& error) {
    Log().warn("{}: no growth of the map and no pictures: {}", report->run.name, error.what());
  }
}

nlohmann::ordered_json RunReportJson(const RunReport& report, int max_points) {
  const Timestamp start = report.Start();
  const Eigen::Vector3d antenna =
      report.evaluation ? report.evaluation->antenna_cam_m : Eigen::Vector3d::Zero();
  const double offset_s = report.evaluation ? report.evaluation->time_offset_s : 0;
  const Trajectory path = MoveToAntenna(report.WorldFromMap(), report.run.trajectory, antenna);
  const Trajectory keyframes = MoveToAntenna(report.WorldFromMap(), report.run.keyframes, antenna);
  Json json = {{"name", report.run.name},
               {"summary", report.run.summary},
               {"unit", report.evaluation ? "m" : "map units"},
               {"problem", report.problem},
               {"path", PathJson(path, start, offset_s)},
               {"keyframes", PathJson(keyframes, start, offset_s)},
               {"cloud", CloudJson(report, max_points)},
               {"growth", GrowthJson(report)},
               {"stages", StagesJson(report.run)},
               {"lost", LostJson(report.run)},
               {"pictures", report.pictures},
               {"survey", report.survey}};
  json["keyframes"]["q"] = PackFloats(Orientations(keyframes));
  json["evaluation"] = report.evaluation ? EvaluationSection(report) : Json();
  return json;
}

}  // namespace deepuav
