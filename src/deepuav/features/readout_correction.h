#pragma once

#include "deepuav/features/features.h"
#include "deepuav/geometry/rolling_shutter.h"

namespace deepuav {

/// The undistorted pixel as the key point's own row saw it; `motion` is the one that its `px` was
/// corrected for.
Eigen::Vector2d PixelInRow(const Keypoint& keypoint, const ReadoutMotion& motion,
                           const Camera& camera);

/// Where the camera of the middle row would have seen what the key point shows at a depth.
Eigen::Vector2d PixelInMiddleRow(const Keypoint& keypoint, const ReadoutMotion& motion,
                                 const Camera& camera, double inverse_depth);

/// The key points with `px` as the middle row sees them where the camera turned as `motion` says;
/// so far they are as `known` says. Travel moves none: it takes a depth.
Features CorrectedForTurn(const Features& features, const ReadoutMotion& known,
                          const ReadoutMotion& motion, const Camera& camera);

}  // namespace deepuav
