#include "deepuav/evaluation/report/evaluation_report.h"

#include <fmt/format.h>

#include <array>
#include <iterator>
#include <utility>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

const std::pair<const char*, std::optional<AlignmentKind>> kAlignmentNames[] = {
    {"sim3", AlignmentKind::kSimilar},
    {"se3", AlignmentKind::kRigid},
    {"yaw", AlignmentKind::kYaw},
    {"none", std::nullopt}};
constexpr std::pair<const char*, RpeUnit> kRpeUnitNames[] = {
    {"frames", RpeUnit::kFrames}, {"m", RpeUnit::kMetres}, {"s", RpeUnit::kSeconds}};

nlohmann::json StatisticsJson(const ErrorStatistics& statistics) {
  return {{"count", statistics.count}, {"rmse", statistics.rmse},     {"mean", statistics.mean},
          {"std", statistics.std},     {"median", statistics.median}, {"min", statistics.min},
          {"max", statistics.max},     {"sse", statistics.sse}};
}

nlohmann::json RelativeErrorJson(const RelativeError& rpe, const RpeOptions& options) {
  nlohmann::json json = {
      {"delta", options.delta},         {"unit", RpeUnitName(options.unit)},
      {"all_pairs", options.all_pairs}, {"compares", rpe.rotation_deg ? "motion" : "distance"},
      {"pairs", rpe.pairs.size()},      {"translation_m", StatisticsJson(rpe.translation_m)}};
  json["rotation_deg"] = rpe.rotation_deg ? StatisticsJson(*rpe.rotation_deg) : nlohmann::json();
  return json;
}

nlohmann::json AlignmentJson(const Sim3& truth_from_estimate, std::optional<AlignmentKind> kind) {
  const Eigen::Quaterniond& rotation = truth_from_estimate.rotation();
  const Eigen::Vector3d& translation = truth_from_estimate.translation();
  return {{"kind", AlignmentName(kind)},
          {"scale", truth_from_estimate.scale()},
          {"rotation_wxyz", {rotation.w(), rotation.x(), rotation.y(), rotation.z()}},
          {"translation_m", {translation.x(), translation.y(), translation.z()}}};
}

std::string StatisticsRow(const std::string& name, const ErrorStatistics& statistics) {
  return fmt::format("{:<22}{:>11.6f}{:>11.6f}{:>11.6f}{:>11.6f}{:>11.6f}{:>11.6f}\n", name,
                     statistics.rmse, statistics.mean, statistics.median, statistics.std,
                     statistics.min, statistics.max);
}

nlohmann::json AxesJson(const Evaluation& evaluation) {
  const Eigen::Vector3d& rms_m = evaluation.ate.rms_along_axes_m;
  auto json = nlohmann::json::array({rms_m.x(), rms_m.y(), rms_m.z()});
  if (evaluation.horizontal) json[2] = nullptr;
  return json;
}

/// Says which axis is up where the truth does.
std::string AxesRow(const Evaluation& evaluation) {
  const Eigen::Vector3d& rms_m = evaluation.ate.rms_along_axes_m;
  std::string row = fmt::format("ATE's rmse along x {:.6f}, along y {:.6f}", rms_m.x(), rms_m.y());
  if (!evaluation.horizontal) {
    row += fmt::format(", along z{} {:.6f}", evaluation.z_is_up ? " (up)" : "", rms_m.z());
  }
  return row + " m\n";
}

std::string RelativeErrorRows(const Evaluation& evaluation, const RpeOptions& options) {
  const std::string step = fmt::format("{:g} {}", options.delta, RpeUnitName(options.unit));
  if (!evaluation.rpe) return fmt::format("RPE: no two poses are {} apart\n", step);
  const RelativeError& rpe = *evaluation.rpe;
  std::string rows =
      StatisticsRow(rpe.rotation_deg ? "RPE translation, m" : "RPE distance, m", rpe.translation_m);
  if (rpe.rotation_deg) rows += StatisticsRow("RPE rotation, deg", *rpe.rotation_deg);
  return rows + fmt::format("RPE over {}: {} pairs, {}\n", step, rpe.pairs.size(),
                            options.all_pairs ? "from every pose" : "end to end");
}

}  // namespace

std::string AlignmentName(std::optional<AlignmentKind> kind) {
  for (const auto& [name, known] : kAlignmentNames) {
    if (known == kind) return name;
  }
  return "none";
}

std::optional<AlignmentKind> ParseAlignment(const std::string& name) {
  for (const auto& [known, kind] : kAlignmentNames) {
    if (name == known) return kind;
  }
  throw Error("Found '{}' as the alignment, expected sim3, se3, yaw or none", name);
}

std::string RpeUnitName(RpeUnit unit) {
  for (const auto& [name, known] : kRpeUnitNames) {
    if (known == unit) return name;
  }
  return "";
}

RpeUnit ParseRpeUnit(const std::string& name) {
  for (const auto& [known, unit] : kRpeUnitNames) {
    if (name == known) return unit;
  }
  throw Error("Found '{}' as the unit of the step, expected frames, m or s", name);
}

nlohmann::json EvaluationJson(const Evaluation& evaluation, const EvaluationOptions& options) {
  nlohmann::json times = nlohmann::json::array();
  for (const TimedPose& pose : evaluation.matched_truth) times.push_back(pose.time.nanoseconds);
  const Eigen::Vector3d& antenna_cam_m = evaluation.antenna_cam_m;
  const auto antenna =
      nlohmann::json::array({antenna_cam_m.x(), antenna_cam_m.y(), antenna_cam_m.z()});
  nlohmann::json json = {
      {"truth_poses", evaluation.truth.size()},
      {"truth_path_m", PathLengthM(evaluation.truth)},
      {"compared_path_m", evaluation.ComparedPathM()},
      {"estimate_poses", evaluation.estimate_poses},
      {"associated_poses", evaluation.matched_truth.size()},
      {"shared_poses", evaluation.shared_poses},
      {"completeness", evaluation.Completeness()},
      {"alignment", AlignmentJson(evaluation.ate.truth_from_estimate, options.alignment)},
      {"horizontal", evaluation.horizontal},
      {"interpolated", evaluation.interpolated},
      {"truth_is_interpolated", evaluation.truth_is_interpolated},
      {"time_offset_s", evaluation.time_offset_s},
      {"antenna_cam_m", antenna},
      {"ate_m", StatisticsJson(evaluation.ate.statistics_m)},
      {"ate_rmse_along_axes_m", AxesJson(evaluation)},
      {"per_pose", {{"truth_time_ns", times}, {"error_m", evaluation.ate.errors_m}}}};
  json["rpe"] = evaluation.rpe ? RelativeErrorJson(*evaluation.rpe, options.rpe) : nlohmann::json();
  return json;
}

std::string EvaluationTable(const Evaluation& evaluation, const EvaluationOptions& options) {
  std::string table =
      fmt::format("Associated {} of {} estimate poses with {} truth poses: completeness {:.1f} %\n",
                  evaluation.matched_truth.size(), evaluation.estimate_poses,
                  evaluation.truth.size(), 100 * evaluation.Completeness());
  if (evaluation.shared_poses > 0) {
    table += fmt::format("{} pairs share a pose with another pair (--one-to-one drops them)\n",
                         evaluation.shared_poses);
  }
  if (evaluation.interpolated) {
    table += evaluation.truth_is_interpolated
                 ? "The truth is interpolated at the estimate's moments\n"
                 : "The estimate is interpolated at the truth's moments\n";
  }
  if (evaluation.time_offset_s != 0) {
    table += fmt::format("Time offset {:+.6f} s added to the estimate{}\n",
                         evaluation.time_offset_s, options.search_offset_s > 0 ? ", as found" : "");
  }
  if (const Eigen::Vector3d& antenna = evaluation.antenna_cam_m; !antenna.isZero()) {
    table += fmt::format("The truth is the path of the camera's point {:.3f}, {:.3f}, {:.3f} m\n",
                         antenna.x(), antenna.y(), antenna.z());
  }
  table += fmt::format("Truth path {:.3f} m; alignment {}, scale {:.6f}\n\n",
                       PathLengthM(evaluation.truth), AlignmentName(options.alignment),
                       evaluation.ate.truth_from_estimate.scale());
  table += fmt::format("{:<22}{:>11}{:>11}{:>11}{:>11}{:>11}{:>11}\n", "", "rmse", "mean", "median",
                       "std", "min", "max");
  table += StatisticsRow(evaluation.horizontal ? "ATE horizontal, m" : "ATE, m",
                         evaluation.ate.statistics_m);
  table += RelativeErrorRows(evaluation, options.rpe);
  return table + AxesRow(evaluation);
}

}  // namespace deepuav
