#include "deepuav/capture/size_fitter.h"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace deepuav {

bool SizeFitter::HasSameProportions(const cv::Size& size) const {
  constexpr double kSameProportions = 0.01;  // Sizes are rounded to whole pixels.
  const double x = static_cast<double>(size.width) / calibrated_.width;
  const double y = static_cast<double>(size.height) / calibrated_.height;
  return std::abs(x / y - 1) <= kSameProportions;
}

std::optional<GreyImage> SizeFitter::Fit(const GreyImage& image, std::string* change) {
  change->clear();
  const cv::Size size = image.size();
  const bool fits = HasSameProportions(size);
  if (size != last_) {
    *change = fmt::format(
        "images are {}x{} now: {}", size.width, size.height,
        size == calibrated_ ? std::string("as calibrated")
        : fits ? fmt::format("scaled to {}x{} as calibrated", calibrated_.width, calibrated_.height)
               : fmt::format("left out, as their proportions are not "
                             "those of the calibrated {}x{}",
                             calibrated_.width, calibrated_.height));
  }
  last_ = size;
  if (size == calibrated_) return image;
  if (!fits) return std::nullopt;
  GreyImage scaled;
  cv::resize(image, scaled, calibrated_, 0, 0,
             size.width > calibrated_.width ? cv::INTER_AREA : cv::INTER_LINEAR);
  return scaled;
}

}  // namespace deepuav
