#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace deepuav {

/// The same point in two images, px.
struct PointPair {
  Eigen::Vector2d a_px, b_px;
};

struct LocalWarpOptions {
  int neighbours = 24;      ///< Pairs around each that tell how its surroundings change.
  int min_agreeing = 6;     ///< Of these; fewer tell nothing.
  double max_error_px = 4;  ///< Of a pair that agrees.
  double max_stretch = 3;   ///< Ratio of the largest to the least magnification; more is no view.
  double first_scale_px = 128;  ///< Error at which a pair weighs half in the first fit...
  int rounds = 10;              ///< ...of so many, at half the error in each.
};

/// d b pixel / d a pixel around each pair, where no poses are known: the affinity of the pairs
/// around it, fitted robustly. Nothing where too few of them agree with one.
std::vector<std::optional<Eigen::Matrix2d>> LocalWarps(const std::vector<PointPair>& pairs,
                                                       const LocalWarpOptions& options = {});

}  // namespace deepuav
