#pragma once

#include <Eigen/Core>

#include "deepuav/image/image.h"

namespace deepuav {

/// At which size a network sees the images of a camera, and where their pixels lie there.
class SeenSize {
 public:
  /// Images of more than `max_pixels` are reduced to about as many; 0: none are.
  SeenSize(int width, int height, double max_pixels = 0);

  int width() const { return width_; }  ///< px
  int height() const { return height_; }
  bool IsReduced() const { return width_ != image_width_ || height_ != image_height_; }

  /// The image itself, or `buffer` with the image reduced. Throws Error for one of another size
  /// than the camera's.
  const GreyImage& Reduce(const GreyImage& image, GreyImage* buffer) const;

  Eigen::Vector2f ToNetwork(const Eigen::Vector2f& image_px) const;
  Eigen::Vector2f ToImage(const Eigen::Vector2f& network_px) const;
  /// Of a pixel of the network's, in pixels of the image.
  double PixelLength() const;

 private:
  const int image_width_, image_height_;
  int width_, height_;
  Eigen::Vector2f network_per_image_;
};

}  // namespace deepuav
