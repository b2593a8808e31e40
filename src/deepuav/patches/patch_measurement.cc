#include "deepuav/patches/patch_measurement.h"

#include <Eigen/LU>

namespace deepuav {

std::optional<AlignedPatch> AlignSurface(const ImagePyramid& reference, const SurfacePatch& patch_a,
                                         const SE3& b_from_a, const ImagePyramid& image,
                                         const Eigen::Vector2d& start_image_px,
                                         const Camera& camera, const PatchOptions& options) {
  const auto warp = PatchWarp(patch_a, b_from_a, camera);
  const auto reference_px =
      DistortInRow(camera, patch_a.px, patch_a.motion, 1 / patch_a.point_cam.z());
  if (!warp || !reference_px) return std::nullopt;
  return AlignPatch(reference, *reference_px, *warp, image, start_image_px, options);
}

std::optional<PixelMeasurement> Undistorted(const Eigen::Vector2d& image_px,
                                            const PixelNoise& noise, const DetectedPixel& known,
                                            const Camera& camera, double inverse_depth) {
  const auto lens = DistortionJacobian(camera, known.px);
  if (!lens) return std::nullopt;
  // Over the few pixels that a patch is shifted the lens is linear.
  const Eigen::Matrix2d undistorting = lens->inverse();
  const Eigen::Vector2d in_row = known.px + undistorting * (image_px - known.image_px);
  const Eigen::Vector2d px = ToMiddleRow(
      camera.pinhole, in_row, RowMoment(image_px.y(), camera.height), known.motion, inverse_depth);
  const Eigen::Matrix2d covariance = undistorting * noise.Covariance() * undistorting.transpose();
  return PixelMeasurement{px.cast<float>(), PixelNoise(covariance), true};
}

std::optional<PixelMeasurement> MeasurePatch(const ImagePyramid& reference,
                                             const SurfacePatch& patch_a, const SE3& b_from_a,
                                             const ImagePyramid& image, const DetectedPixel& start,
                                             const Camera& camera, const PatchOptions& options) {
  const auto aligned =
      AlignSurface(reference, patch_a, b_from_a, image, start.image_px, camera, options);
  if (!aligned) return std::nullopt;
  const double depth_b = (b_from_a * patch_a.point_cam).z();
  return Undistorted(aligned->px, aligned->noise, start, camera, 1 / depth_b);
}

}  // namespace deepuav
