#include "deepuav/api/evaluate.h"

#include "deepuav/api/conversions.h"
#include "deepuav/api/guarded.h"
#include "deepuav/evaluation/measures/evaluation.h"
#include "deepuav/evaluation/report/evaluation_report.h"

namespace deepuav::api {
namespace {

EvaluationOptions OptionsOf(const EvaluationSetup& setup) {
  EvaluationOptions options;
  options.alignment = ParseAlignment(setup.align);
  options.association.max_difference_s = setup.max_difference_s;
  options.association.time_offset_s = setup.time_offset_s;
  options.rpe.delta = setup.rpe_delta;
  options.rpe.unit = ParseRpeUnit(setup.rpe_unit);
  options.Check();
  return options;
}

ErrorStatistics ToApi(const core::ErrorStatistics& statistics) {
  return {statistics.rmse, statistics.mean, statistics.median, statistics.max};
}

EvaluationResult Compare(const Truth& truth, const Trajectory& estimate,
                         const EvaluationSetup& setup) {
  const EvaluationOptions options = OptionsOf(setup);
  const Evaluation evaluation = EvaluateTrajectory(truth, estimate, options);
  EvaluationResult result;
  result.pairs = static_cast<int>(evaluation.matched_truth.size());
  result.ate_m = ToApi(evaluation.ate.statistics_m);
  if (evaluation.rpe) result.rpe_m = ToApi(evaluation.rpe->translation_m);
  result.scale = evaluation.ate.truth_from_estimate.scale();
  result.completeness = evaluation.Completeness();
  result.json = EvaluationJson(evaluation, options).dump(2) + "\n";
  return result;
}

}  // namespace

EvaluationResult Evaluate(const std::vector<TimedPose>& truth,
                          const std::vector<TimedPose>& estimate, const EvaluationSetup& setup) {
  return Guarded([&] {
    Truth known;
    known.trajectory = ToCore(truth);
    return Compare(known, ToCore(estimate), setup);
  });
}

EvaluationResult Evaluate(const std::string& truth, const std::string& estimate,
                          const EvaluationSetup& setup) {
  return Guarded([&] {
    const Truth known = LoadTruth(std::filesystem::path(truth), TruthOptions{});
    return Compare(known, LoadEstimate(estimate, known), setup);
  });
}

}  // namespace deepuav::api
