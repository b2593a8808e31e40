#pragma once

#include <vector>

#include "deepuav/inertial/chain/inertial_adjustment.h"

namespace deepuav {

/// The path without poses far from where their neighbours have them, and without these neighbours.
/// Where an adjustment starts a wrong pose would pull the scale down, as it weighs less there.
Trajectory WithoutJumps(const Trajectory& path);

/// What the poses of a path err by, from their residuals: turns alike along the whole path,
/// positions as the residuals about each pose, as cameras far from what they see err by more.
void EstimatePathNoise(const std::vector<Vector6d>& residuals, InertialProblem* problem);

/// By how much the variance of a mean is larger than if the errors of positions were independent of
/// one another: 1 and twice the sum of their correlations.
double VarianceInflation(const std::vector<Vector6d>& residuals, const InertialProblem& problem);

}  // namespace deepuav
