#pragma once

#include <filesystem>
#include <list>
#include <opencv2/core/types.hpp>
#include <optional>

#include "deepuav/features/superpoint.h"
#include "deepuav/features/superpoint_turned.h"

namespace deepuav {

/// An image, and the size that it had before it was reduced, in pixels.
struct ReducedImage {
  GreyImage image;
  cv::Size original_size;

  /// The place in the original of a pixel of `image`.
  Eigen::Vector2d ToOriginal(const Eigen::Vector2f& px) const;
  /// The inverse of ToOriginal.
  Eigen::Vector2d FromOriginal(const Eigen::Vector2d& px) const;

 private:
  Eigen::Array2d OriginalOverReduced() const;
};

/// Reduced to `max_side_px` along its longer side where it is larger.
ReducedImage Reduced(const GreyImage& image, int max_side_px);

/// As grey, reduced likewise. Throws Error naming the file.
ReducedImage LoadReduced(const std::filesystem::path& file, int max_side_px);

/// SuperPoint on images of any size, without a calibration. Keeps the networks of the last few
/// sizes: making one takes longer than running it.
class AnySizeExtractor : public LenslessExtractor {
 public:
  /// `seen_share`: of the pixels of each image that the network sees; 0: what the options say.
  AnySizeExtractor(const SuperPointOptions& options, const InferenceOptions& inference,
                   double seen_share = 0)
      : options_(options), inference_(inference), seen_share_(seen_share) {}

  Features Extract(const GreyImage& image) override;
  /// `features` are of `image`.
  TurnedDescriptors DescribeTurned(const GreyImage& image, const Features& features);

 private:
  struct Networks {
    Networks(const cv::Size& size, const SuperPointOptions& options,
             const InferenceOptions& inference);

    cv::Size size;
    SuperPoint upright;
    std::optional<SuperPointTurned> turned;
  };

  SuperPointOptions OptionsFor(const cv::Size& size) const;
  Networks& NetworksFor(const cv::Size& size);

  const SuperPointOptions options_;
  const InferenceOptions inference_;
  const double seen_share_;
  std::list<Networks> networks_;  ///< The last used first.
};

}  // namespace deepuav
