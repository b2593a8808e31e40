#pragma once

#include <string>
#include <vector>

#include "deepuav/api/types.h"

namespace deepuav::api {

struct EvaluationSetup {
  std::string align = "sim3";       ///< sim3, se3, yaw or none.
  double max_difference_s = 0.01;   ///< Of time stamps that belong together.
  double time_offset_s = 0;         ///< Added to the estimate's.
  double rpe_delta = 1;             ///< Step of the relative error...
  std::string rpe_unit = "frames";  ///< ...in frames, m or s.
};

struct ErrorStatistics {
  double rmse = 0, mean = 0, median = 0, max = 0;
};

struct EvaluationResult {
  int pairs = 0;            ///< Poses compared.
  ErrorStatistics ate_m;    ///< Absolute, after alignment.
  ErrorStatistics rpe_m;    ///< Relative, a step; 0 where no two poses are one apart.
  double scale = 1;         ///< That the estimate was multiplied by.
  double completeness = 0;  ///< Share of the truth's poses that have an estimate.
  std::string json;         ///< All figures, as `deepuav eval --json` writes them.
};

/// Compares trajectories, or the files and datasets that `deepuav eval` takes. Thread-safe. Throws
/// Error for what cannot be read, associated or aligned.
DEEPUAV_API EvaluationResult Evaluate(const std::vector<TimedPose>& truth,
                                      const std::vector<TimedPose>& estimate,
                                      const EvaluationSetup& setup = {});
DEEPUAV_API EvaluationResult Evaluate(const std::string& truth, const std::string& estimate,
                                      const EvaluationSetup& setup = {});

}  // namespace deepuav::api
