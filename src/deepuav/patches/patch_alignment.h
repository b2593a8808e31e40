#pragma once

#include <Eigen/Core>
#include <optional>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/pixel_noise.h"
#include "deepuav/image/pyramid.h"

namespace deepuav {

struct PatchOptions {
  bool enabled = true;  ///< Else key points stay where the detector put them.
  int max_iterations = 10;
  double converged_px = 0.01;     ///< A step shorter than this is the last.
  double max_shift_px = 2.5;      ///< From where the patch was sought, in pixels of the image.
  double min_correlation = 0.8;   ///< Of the aligned patches, normalised.
  double min_contrast_grey = 3;   ///< Standard deviation within a patch.
  double prior_sigma_px = 0.7;    ///< Of where the patch is sought: holds it along an edge.
  double image_noise_grey = 2;    ///< Least standard deviation of a pixel's value.
  double noise_factor = 2;        ///< Standard deviations over those of independent pixel noise.
  double min_sigma_px = 0.04;     ///< Of an aligned position, however well the patches agree.
  double max_scale_change = 1.5;  ///< Beyond it one of the two images is taken at half size.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("enabled", enabled, "",
          "measure landmarks by patches of the keyframes' images, to a tenth of a pixel");
    visit("max_iterations", max_iterations, "", "most steps of an alignment", Between(1, 100));
    visit("converged_px", converged_px, "px", "length of a step that is the last", Within(0, 1));
    visit("max_shift_px", max_shift_px, "px", "distance of an aligned position from the key point",
          Above(0, 100));
    visit("min_correlation", min_correlation, "", "of a patch with its reference", Below(0, 1));
    visit("min_contrast_grey", min_contrast_grey, "", "standard deviation of grey in a patch",
          Within(0, 128));
    visit("prior_sigma_px", prior_sigma_px, "px",
          "standard deviation of the key point that an alignment starts from", Above(0, 100));
    visit("image_noise_grey", image_noise_grey, "",
          "standard deviation of a pixel's grey, at least", Within(0, 128));
    visit("noise_factor", noise_factor, "",
          "standard deviation of an aligned position over what independent pixel noise would give",
          Between(1, 100));
    visit("min_sigma_px", min_sigma_px, "px", "standard deviation of an aligned position, at least",
          Above(0, 10));
    visit("max_scale_change", max_scale_change, "",
          "magnification beyond which an image is taken at half size", Between(1.42, 4));
  }
};

/// Where an image shows a patch.
struct AlignedPatch {
  Eigen::Vector2d px;
  PixelNoise noise;
  double correlation = 0;  ///< Normalised, of both patches; 1: alike but for gain and offset.
};

/// Finds where `image` shows what `reference` shows around `reference_px`, starting at `start_px`:
/// 15x15 pixels, the reference warped into the image's geometry once, translation by inverse
/// compositional steps (Baker and Matthews 2004), gain and offset free (projected out). Pixels are
/// those of the images as taken; `image_from_reference` is d image pixel / d reference pixel.
/// Where one shows the patch much larger, its coarser level is taken. Nothing where the patch does
/// not lie within both images, has no contrast, runs away or does not correlate.
std::optional<AlignedPatch> AlignPatch(const ImagePyramid& reference,
                                       const Eigen::Vector2d& reference_px,
                                       const Eigen::Matrix2d& image_from_reference,
                                       const ImagePyramid& image, const Eigen::Vector2d& start_px,
                                       const PatchOptions& options);

}  // namespace deepuav
