#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace deepuav {

/// A grey texture with halved copies of itself, so that it can be read smoothed to the footprint of
/// a ray.
class MipTexture {
 public:
  enum class Edge { kRepeat, kClamp };

  /// A repeated texture must be square with a side that is a power of two.
  MipTexture(const cv::Mat1b& pixels, Edge edge);

  /// 0 to 1 at (u, v), where a tile spans [0, 1) in u (and v, if square), smoothed over about
  /// `footprint`, all in widths of the tile.
  float Sample(float u, float v, float footprint) const {
    const float texels = footprint * width_;
    if (texels <= 1) return Bilinear(levels_.front(), u, v);
    const auto bits = std::bit_cast<uint32_t>(texels);
    // The logarithm to base 2, straight between the powers of 2: exponent and mantissa.
    const size_t fine = (bits >> 23) - 127;
    if (fine + 1 >= levels_.size()) return Bilinear(levels_.back(), u, v);
    const float fraction = std::bit_cast<float>((bits & 0x7fffffu) | 0x3f800000u) - 1;
    const float finer = Bilinear(levels_[fine], u, v);
    return finer + fraction * (Bilinear(levels_[fine + 1], u, v) - finer);
  }

  /// Height of a tile in widths.
  float aspect() const {
    return static_cast<float>(levels_.front().rows) / static_cast<float>(levels_.front().cols);
  }

 private:
  // Rows have one more texel than there are columns, and there is one more row: what lies beyond
  // the edge, so that the neighbours of a texel follow it in memory.
  struct Level {
    std::vector<uint8_t> texels;
    int cols = 0, rows = 0;
    float scale = 0;  // Texels in the width of a tile.
  };

  float Bilinear(const Level& level, float u, float v) const {
    float x = u * level.scale - 0.5f, y = v * level.scale - 0.5f;
    if (edge_ == Edge::kClamp) {
      x = std::clamp(x, 0.0f, static_cast<float>(level.cols - 1));
      y = std::clamp(y, 0.0f, static_cast<float>(level.rows - 1));
    }
    const float floor_x = std::floor(x), floor_y = std::floor(y);
    const float fx = x - floor_x, fy = y - floor_y;
    int x0 = static_cast<int>(floor_x), y0 = static_cast<int>(floor_y);
    if (edge_ == Edge::kRepeat) x0 &= level.cols - 1, y0 &= level.rows - 1;
    const ptrdiff_t stride = level.cols + 1;
    const uint8_t* upper = level.texels.data() + y0 * stride + x0;
    const uint8_t* lower = upper + stride;
    const auto along = [fx](const uint8_t* pair) {
      return static_cast<float>(pair[0]) + fx * static_cast<float>(pair[1] - pair[0]);
    };
    const float top = along(upper), bottom = along(lower);
    return (top + fy * (bottom - top)) * (1.0f / 255);
  }

  std::vector<Level> levels_;
  Edge edge_;
  float width_;
};

}  // namespace deepuav
