#pragma once

#include <vector>

#include "deepuav/estimation/two_views/two_view.h"

namespace deepuav {

/// How well two views tell the distances of what they see: of each valid point the standard
/// deviation of its distance from camera a over that distance, with what is not known of the pose
/// (but for the baseline's length, the unit) counted in; infinite of points that are not valid.
/// From the Schur complement of the points in the equations of both views, for errors of `sigma_px`
/// an axis where a pair's noise ratio is 1. Points as good as infinitely far have a large one.
std::vector<double> RelativeDistanceSigmas(const Pinhole& pinhole,
                                           const std::vector<PixelPair>& pairs,
                                           const TwoViewSolution& solution, double sigma_px);

/// The standard deviation an axis of pixels whose noise ratio is 1, at least `least_px`, by the
/// median of the valid points' epipolar errors (Sampson; Hartley and Zisserman 11.4.3).
double EpipolarSigmaPx(const Pinhole& pinhole, const std::vector<PixelPair>& pairs,
                       const TwoViewSolution& solution, double least_px);

}  // namespace deepuav
