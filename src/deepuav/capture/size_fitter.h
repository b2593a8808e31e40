#pragma once

#include <opencv2/core/types.hpp>
#include <optional>
#include <string>

#include "deepuav/image/image.h"

namespace deepuav {

/// Brings images of any size to the one that the calibration is for.
class SizeFitter {
 public:
  explicit SizeFitter(const cv::Size& calibrated) : calibrated_(calibrated), last_(calibrated) {}

  /// Nothing where the proportions are others. `change` says so when the size is another than that
  /// of the image before, and is empty otherwise.
  std::optional<GreyImage> Fit(const GreyImage& image, std::string* change);

 private:
  bool HasSameProportions(const cv::Size& size) const;

  const cv::Size calibrated_;
  cv::Size last_;
};

}  // namespace deepuav
