#include "deepuav/simulation/world/mip_texture.h"

#include <algorithm>
#include <bit>

#include "deepuav/base/error.h"

namespace deepuav {

MipTexture::MipTexture(const cv::Mat1b& pixels, Edge edge)
    : edge_(edge), width_(static_cast<float>(pixels.cols)) {
  const bool square_power = pixels.rows == pixels.cols && pixels.cols > 0 &&
                            std::has_single_bit(static_cast<unsigned>(pixels.cols));
  if (pixels.empty() || (edge == Edge::kRepeat && !square_power)) {
    throw Error(
        "a texture has {} x {} pixels: expected a square power of two to repeat, or any but none",
        pixels.cols, pixels.rows);
  }
  cv::Mat1f current;
  pixels.convertTo(current, CV_32F);
  for (float scale = width_;; scale /= 2) {
    Level level{{}, current.cols, current.rows, scale};
    cv::Mat1f edged;
    cv::copyMakeBorder(current, edged, 0, 1, 0, 1,
                       edge == Edge::kRepeat ? cv::BORDER_WRAP : cv::BORDER_REPLICATE);
    level.texels.reserve(edged.total());
    for (const float value : edged) level.texels.push_back(cv::saturate_cast<uint8_t>(value));
    levels_.push_back(std::move(level));
    if (current.cols == 1 && current.rows == 1) break;

    cv::Mat1f half((current.rows + 1) / 2, (current.cols + 1) / 2);
    for (int y = 0; y < half.rows; ++y) {
      const int y0 = 2 * y, y1 = std::min(y0 + 1, current.rows - 1);
      for (int x = 0; x < half.cols; ++x) {
        const int x0 = 2 * x, x1 = std::min(x0 + 1, current.cols - 1);
        half(y, x) = (current(y0, x0) + current(y0, x1) + current(y1, x0) + current(y1, x1)) / 4;
      }
    }
    current = half;
  }
}

}  // namespace deepuav
