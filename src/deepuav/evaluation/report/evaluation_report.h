#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "deepuav/evaluation/measures/evaluation.h"

namespace deepuav {

/// "sim3", "se3", "yaw" or "none"; and back, throwing Error for another name.
std::string AlignmentName(std::optional<AlignmentKind> kind);
std::optional<AlignmentKind> ParseAlignment(const std::string& name);

/// "frames", "m" or "s"; and back, throwing Error for another name.
std::string RpeUnitName(RpeUnit unit);
RpeUnit ParseRpeUnit(const std::string& name);

/// Every figure, the alignment, and the error of each pose. Keys are in alphabetical order, numbers
/// exact.
nlohmann::json EvaluationJson(const Evaluation& evaluation, const EvaluationOptions& options);

/// A table for people.
std::string EvaluationTable(const Evaluation& evaluation, const EvaluationOptions& options);

}  // namespace deepuav
