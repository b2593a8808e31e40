#include "deepuav/image/pyramid.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr int kMinSidePx = 2;

}  // namespace

ImagePyramid::ImagePyramid(const GreyImage& image, int levels) {
  if (image.empty()) throw Error("image pyramid: the image is empty");
  if (levels < 1) throw Error("image pyramid: found {} levels, expected at least 1", levels);
  levels_.push_back(image);
  while (static_cast<int>(levels_.size()) < levels) {
    const GreyImage& finer = levels_.back();
    const cv::Size half(finer.cols / 2, finer.rows / 2);
    if (std::min(half.width, half.height) < kMinSidePx) break;
    // An odd last row or column belongs to no pixel of the coarser level.
    const GreyImage even = finer(cv::Rect(0, 0, 2 * half.width, 2 * half.height));
    GreyImage coarser;
    cv::resize(even, coarser, half, 0, 0, cv::INTER_AREA);
    levels_.push_back(coarser);
  }
}

}  // namespace deepuav
