#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "deepuav/evaluation/measures/evaluation.h"
#include "deepuav/evaluation/measures/truth.h"

namespace deepuav {

/// How the command line wants trajectories compared.
struct EvaluationArguments {
  std::string alignment = "sim3", rpe_unit = "frames";
  std::vector<double> lever_arm_m;
  TruthOptions truth_options;
  EvaluationOptions options;
};

void AddEvaluationArguments(CLI::App* command, EvaluationArguments* arguments);

/// Fills `options` and `truth_options` once the command line was read. Throws CLI::ValidationError
/// for values that cannot be.
void FinishEvaluationArguments(EvaluationArguments* arguments);

}  // namespace deepuav
