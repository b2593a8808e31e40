#pragma once

#include <functional>
#include <memory>

#include "deepuav/features/features.h"

namespace deepuav {

/// Where another calibration sees what a pixel of the undistorted camera shows.
using PixelMove = std::function<Eigen::Vector2f(const Eigen::Vector2f&)>;

/// A copy whose key points lie elsewhere in the undistorted camera. Null stays null.
std::shared_ptr<const Features> MovedFeatures(const std::shared_ptr<const Features>& features,
                                              const PixelMove& move);

}  // namespace deepuav
