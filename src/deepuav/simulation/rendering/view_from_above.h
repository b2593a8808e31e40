#pragma once

#include <Eigen/Core>
#include <functional>
#include <opencv2/core.hpp>

#include "deepuav/simulation/rendering/render_options.h"
#include "deepuav/simulation/world/world.h"

namespace deepuav {

/// What stands in the world, seen straight down everywhere: the orthophoto that photographs cannot
/// better, and its heights.
struct ViewFromAbove {
  cv::Mat1f radiance;
  cv::Mat1f height_m;  ///< Of what is seen, in the world; NaN where there is nothing.
};

/// `place_of`: x and y in the world of a place of the raster (column and row, whole numbers in the
/// middle of a cell); called from several threads. `cell_m`: the width of a cell. Throws Error for
/// a hall, whose roof hides it.
ViewFromAbove LookDown(const World& world, const RenderOptions& options, const cv::Size& size,
                       double cell_m,
                       const std::function<Eigen::Vector2d(double column, double row)>& place_of);

}  // namespace deepuav
