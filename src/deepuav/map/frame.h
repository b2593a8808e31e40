#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>

#include "deepuav/base/ids.h"
#include "deepuav/base/time.h"
#include "deepuav/features/features.h"
#include "deepuav/geometry/rolling_shutter.h"
#include "deepuav/image/pyramid.h"

namespace deepuav {

/// One image as the rest of the system sees it. Const after extraction; copies share features and
/// image.
struct Frame {
  FrameId id;
  Timestamp time;
  std::shared_ptr<const Features> features;
  std::shared_ptr<const ImagePyramid> image = {};  ///< Null: not kept, as of older map files.
  /// While the image was read. The key points' `px` are of the middle row as far as turning goes;
  /// travel, in units of the map when the frame came into it, moves them by their depth.
  ReadoutMotion motion = {};
  bool turn_is_measured = false;  ///< Itself; else it follows from the path, if at all.
  double turn_sigma_rad = 0;      ///< Of a measured turn: of a gyroscope's none that shows.
  /// How the camera turned since the frame before: now_from_before, by a gyroscope with its bias.
  std::optional<Eigen::Quaterniond> turn_since_before = {};
};

}  // namespace deepuav
