#pragma once

#include <array>
#include <string>

#include "deepuav/evaluation/measures/evaluation.h"

namespace deepuav {

/// The two axes (0: x, 1: y, 2: z) that a plan shows, in rising order: x and y where z is known to
/// be up, else those along which the truth extends furthest.
std::array<int, 2> PlanAxes(const Trajectory& truth, bool z_is_up);

/// An SVG picture: truth and aligned estimate in plan and as x, y and z over time, and the position
/// error over time. Lines break where poses are missing. The same evaluation gives the same text.
std::string PlotTrajectories(const Evaluation& evaluation, const EvaluationOptions& options);

}  // namespace deepuav
