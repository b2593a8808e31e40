#include "deepuav/patches/patch_measurement.h"

#include <Eigen/LU>

namespace deepuav {

std::optional<PixelMeasurement> MeasurePatch(const ImagePyramid& reference,
                                             const SurfacePatch& patch_a, const SE3& b_from_a,
                                             const ImagePyramid& image, const DetectedPixel& start,
                                             const Camera& camera, const PatchOptions& options) {
  const auto warp = PatchWarp(patch_a, b_from_a, camera);
  const auto reference_px = camera.Distort(camera.pinhole.Unproject(patch_a.px));
  const auto lens = DistortionJacobian(camera, start.px);
  if (!warp || !reference_px || !lens) return std::nullopt;
  const auto aligned = AlignPatch(reference, *reference_px, *warp, image, start.image_px, options);
  if (!aligned) return std::nullopt;
  // Over the few pixels that a patch is shifted the lens is linear.
  const Eigen::Matrix2d undistorting = lens->inverse();
  const Eigen::Vector2d px = start.px + undistorting * (aligned->px - start.image_px);
  const Eigen::Matrix2d covariance =
      undistorting * aligned->noise.Covariance() * undistorting.transpose();
  return PixelMeasurement{px.cast<float>(), PixelNoise(covariance), true};
}

}  // namespace deepuav
