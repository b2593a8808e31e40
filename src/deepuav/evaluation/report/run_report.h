#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "deepuav/evaluation/drawing/keyframe_pictures.h"
#include "deepuav/evaluation/drawing/survey_pictures.h"
#include "deepuav/evaluation/measures/evaluation.h"
#include "deepuav/evaluation/report/map_growth.h"
#include "deepuav/evaluation/report/run_folder.h"

namespace deepuav {

/// A run, and what can be said of it.
struct RunReport {
  RunFolder run;
  std::string truth_source;              ///< Where the truth was read; empty for none.
  std::optional<Evaluation> evaluation;  ///< Nothing without truth.
  EvaluationOptions options;             ///< Of the evaluation.
  std::string problem;                   ///< Why there is no evaluation.
  MapGrowth growth;                      ///< Empty where the map could not be read.
  nlohmann::json pictures = nlohmann::json::array();
  nlohmann::json survey;  ///< As SurveyPictures; null where the run is none.

  /// The transform into which all of the run is moved: identity without evaluation.
  Sim3 WorldFromMap() const { return evaluation ? evaluation->ate.truth_from_estimate : Sim3(); }
  /// Seconds of the page begin here.
  Timestamp Start() const;
};

/// Compares the run with the truth at `truth`; with an empty path, with what the run's dataset
/// holds, if it is still there. `problem` says why where a dataset without truth, or a run without
/// poses, gives no evaluation. Throws Error where a truth that was named cannot be used.
void Evaluate(const std::filesystem::path& truth, const EvaluationOptions& options,
              const TruthOptions& truth_options, RunReport* report);

/// Reads the growth of the map, pictures of keyframes and, of photographs, the survey from above
/// out of the run's map.deepuav and dataset, as far as they are there.
void AddMap(const PictureOptions& options, RunReport* report);

/// Everything of the run, for the page; docs/report.md does not promise its shape.
nlohmann::ordered_json RunReportJson(const RunReport& report, int max_points);

}  // namespace deepuav
