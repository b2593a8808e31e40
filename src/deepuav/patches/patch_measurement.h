#pragma once

#include <Eigen/Core>
#include <optional>

#include "deepuav/geometry/pixel_measurement.h"
#include "deepuav/patches/patch_alignment.h"
#include "deepuav/patches/patch_warp.h"

namespace deepuav {

/// Where a detector found something: in the image as taken, and in the undistorted one.
struct DetectedPixel {
  Eigen::Vector2d image_px, px;
};

/// Where `image`, view b, shows the patch that `reference`, view a, shows at `patch_a`, in
/// undistorted pixels; sought at `start`. Nothing where the views do not allow it or the patches do
/// not agree, as AlignPatch. The image of a is read where its lens puts `patch_a.px`.
std::optional<PixelMeasurement> MeasurePatch(const ImagePyramid& reference,
                                             const SurfacePatch& patch_a, const SE3& b_from_a,
                                             const ImagePyramid& image, const DetectedPixel& start,
                                             const Camera& camera, const PatchOptions& options);

}  // namespace deepuav
