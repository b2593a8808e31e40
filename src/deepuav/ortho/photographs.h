#pragma once

#include <opencv2/core.hpp>

namespace deepuav {

/// The pixels of a scene's views. Used by one thread.
class Photographs {
 public:
  virtual ~Photographs() = default;

  /// As they are stored: more cannot be had.
  virtual cv::Size stored_size() const = 0;
  /// Blue, green, red, reduced to `size`; fewer rows where the file breaks off. Throws Error where
  /// it cannot be read.
  virtual cv::Mat3b Load(int view, const cv::Size& size) = 0;
};

}  // namespace deepuav
