#include "deepuav/features/seen_size.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"
#include "deepuav/features/superpoint_postprocessing.h"

namespace deepuav {
namespace {

/// Centres of pixels have whole numbers.
const Eigen::Vector2f kHalf(0.5f, 0.5f);

/// Whole cells, so that nothing is added to the image.
int ReducedSide(int side, double scale) {
  const double cells = scale * side / kSuperPointCell;
  return std::max(1, static_cast<int>(std::lround(cells))) * kSuperPointCell;
}

}  // namespace

SeenSize::SeenSize(int width, int height, double max_pixels)
    : image_width_(width), image_height_(height), width_(width), height_(height) {
  const double pixels = static_cast<double>(width) * height;
  if (max_pixels > 0 && pixels > max_pixels) {
    const double scale = std::sqrt(max_pixels / pixels);
    width_ = std::min(width, ReducedSide(width, scale));
    height_ = std::min(height, ReducedSide(height, scale));
  }
  network_per_image_ = {static_cast<float>(width_) / static_cast<float>(width),
                        static_cast<float>(height_) / static_cast<float>(height)};
}

const GreyImage& SeenSize::Reduce(const GreyImage& image, GreyImage* buffer) const {
  if (image.cols != image_width_ || image.rows != image_height_) {
    throw Error("the image has {}x{} pixels: expected the camera's {}x{}", image.cols, image.rows,
                image_width_, image_height_);
  }
  if (!IsReduced()) return image;
  cv::resize(image, *buffer, {width_, height_}, 0, 0, cv::INTER_AREA);
  return *buffer;
}

Eigen::Vector2f SeenSize::ToNetwork(const Eigen::Vector2f& image_px) const {
  if (!IsReduced()) return image_px;
  return (image_px + kHalf).cwiseProduct(network_per_image_) - kHalf;
}

Eigen::Vector2f SeenSize::ToImage(const Eigen::Vector2f& network_px) const {
  if (!IsReduced()) return network_px;
  return (network_px + kHalf).cwiseQuotient(network_per_image_) - kHalf;
}

double SeenSize::PixelLength() const { return 1 / std::sqrt(network_per_image_.prod()); }

}  // namespace deepuav
