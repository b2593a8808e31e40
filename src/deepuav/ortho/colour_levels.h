#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "deepuav/ortho/node_colours.h"

namespace deepuav {

/// What photographs are multiplied by so that they agree where they overlap: of each its own gain,
/// and of all what the lens darkens towards the corners. By channel: blue, green, red.
struct ColourLevels {
  std::vector<cv::Vec3d> log_gains;        ///< By view; 0 for one without overlap.
  cv::Vec3d falloff2 = {}, falloff4 = {};  ///< Logarithm a radius^2 and radius^4, as Candidate's.

  cv::Vec3d Factor(int view, double radius2) const;
};

/// By least squares over the nodes' colours, robustly: things move, water glitters, clouds pass.
ColourLevels LevelColours(size_t views, const ViewChoice& choice, const NodeColours& colours);

}  // namespace deepuav
