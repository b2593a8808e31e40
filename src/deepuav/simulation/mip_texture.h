#pragma once

#include <cmath>
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
    const float level = std::log2(texels);
    const auto fine = static_cast<size_t>(level);
    if (fine + 1 >= levels_.size()) return Bilinear(levels_.back(), u, v);
    const float fraction = level - static_cast<float>(fine);
    return (1 - fraction) * Bilinear(levels_[fine], u, v) +
           fraction * Bilinear(levels_[fine + 1], u, v);
  }

  /// Height of a tile in widths.
  float aspect() const {
    return static_cast<float>(levels_.front().rows) / static_cast<float>(levels_.front().cols);
  }

 private:
  struct Level {
    std::vector<uint8_t> texels;
    int cols = 0, rows = 0;
    float scale = 0;  // Texels in the width of a tile.
  };

  float Bilinear(const Level& level, float u, float v) const {
    const float x = u * level.scale - 0.5f, y = v * level.scale - 0.5f;
    const float floor_x = std::floor(x), floor_y = std::floor(y);
    const float fx = x - floor_x, fy = y - floor_y;
    int x0 = static_cast<int>(floor_x), y0 = static_cast<int>(floor_y);
    int x1 = x0 + 1, y1 = y0 + 1;
    if (edge_ == Edge::kRepeat) {
      const int mask = level.cols - 1;
      x0 &= mask, x1 &= mask, y0 &= mask, y1 &= mask;
    } else {
      const auto inside = [](int i, int count) { return i < 0 ? 0 : (i < count ? i : count - 1); };
      x0 = inside(x0, level.cols), x1 = inside(x1, level.cols);
      y0 = inside(y0, level.rows), y1 = inside(y1, level.rows);
    }
    const uint8_t* upper = level.texels.data() + static_cast<size_t>(y0) * level.cols;
    const uint8_t* lower = level.texels.data() + static_cast<size_t>(y1) * level.cols;
    const float top = static_cast<float>(upper[x0]) * (1 - fx) + static_cast<float>(upper[x1]) * fx;
    const float bottom =
        static_cast<float>(lower[x0]) * (1 - fx) + static_cast<float>(lower[x1]) * fx;
    return (top * (1 - fy) + bottom * fy) * (1.0f / 255);
  }

  std::vector<Level> levels_;
  Edge edge_;
  float width_;
};

}  // namespace deepuav
