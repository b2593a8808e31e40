#pragma once

#include <vector>

#include "deepuav/image/image.h"

namespace deepuav {

/// An image and its halvings. Level l has pixels of 2^l by 2^l of level 0, each their mean; its
/// pixel (u, v) lies at (2^l (u + 0.5) - 0.5, ...) of level 0. Const once made.
class ImagePyramid {
 public:
  /// Level 0 shares the image's pixels, which must not change any more. Throws Error for an empty
  /// image or `levels` below 1. Levels that would be narrower than 2 pixels are left out.
  ImagePyramid(const GreyImage& image, int levels);

  int levels() const { return static_cast<int>(levels_.size()); }
  const GreyImage& level(int index) const { return levels_[static_cast<size_t>(index)]; }
  const GreyImage& image() const { return levels_.front(); }

 private:
  std::vector<GreyImage> levels_;
};

}  // namespace deepuav
