#pragma once

#include <Eigen/Core>
#include <optional>

#include "deepuav/geometry/pixel_measurement.h"
#include "deepuav/patches/patch_alignment.h"
#include "deepuav/patches/patch_warp.h"

namespace deepuav {

/// Where a detector found something: in the image as taken, and in the undistorted one as the row
/// saw it.
struct DetectedPixel {
  Eigen::Vector2d image_px, px;
  ReadoutMotion motion = {};  ///< Of the view.
};

/// Where `image`, view b, shows the patch that `reference`, view a, shows at `patch_a`, in pixels
/// of the image as taken; sought at `start_image_px`. Nothing where the views do not allow it or
/// the patches do not agree, as AlignPatch. The image of a is read where its lens puts
/// `patch_a.px`.
std::optional<AlignedPatch> AlignSurface(const ImagePyramid& reference, const SurfacePatch& patch_a,
                                         const SE3& b_from_a, const ImagePyramid& image,
                                         const Eigen::Vector2d& start_image_px,
                                         const Camera& camera, const PatchOptions& options);

/// What was found at a pixel of the image as taken, near `known`, in undistorted pixels of the
/// middle row; nothing where the lens has no inverse. `inverse_depth`: of what was found.
std::optional<PixelMeasurement> Undistorted(const Eigen::Vector2d& image_px,
                                            const PixelNoise& noise, const DetectedPixel& known,
                                            const Camera& camera, double inverse_depth = 0);

/// The same in undistorted pixels of the middle row.
std::optional<PixelMeasurement> MeasurePatch(const ImagePyramid& reference,
                                             const SurfacePatch& patch_a, const SE3& b_from_a,
                                             const ImagePyramid& image, const DetectedPixel& start,
                                             const Camera& camera, const PatchOptions& options);

}  // namespace deepuav
