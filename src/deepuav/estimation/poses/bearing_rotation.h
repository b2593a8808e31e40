#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "deepuav/estimation/two_views/two_view.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

struct BearingRotation {
  Eigen::Quaterniond b_from_a;
  std::vector<uint8_t> inlier;  ///< One per pair.
  int inlier_count = 0;
};

/// The turn between two views that most pairs agree on within `tolerance_px` (about the image's
/// centre: an angle), which has room for the parallax of what they show: hypotheses from two pairs
/// each (Kabsch 1976), the best one fitted to all that agree. Nothing for fewer than two pairs.
std::optional<BearingRotation> EstimateBearingRotation(const Pinhole& pinhole,
                                                       const std::vector<PixelPair>& pairs,
                                                       double tolerance_px, int iterations,
                                                       uint64_t seed);

}  // namespace deepuav
