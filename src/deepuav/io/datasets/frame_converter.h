#pragma once

#include <opencv2/core/mat.hpp>

#include "deepuav/io/datasets/ffmpeg_handles.h"

struct SwsContext;

namespace deepuav {

/// Makes images of what FFmpeg decoded. Thread-compatible.
class FrameConverter {
 public:
  enum class Pixels { kGrey, kBgr };

  explicit FrameConverter(Pixels pixels) : pixels_(pixels) {}
  ~FrameConverter();
  FrameConverter(const FrameConverter&) = delete;
  FrameConverter& operator=(const FrameConverter&) = delete;

  /// The picture, of its own size, with room between its rows; empty where it has no size that is
  /// taken, or there is no way from its format. It is the caller's.
  cv::Mat Convert(const AVFrame& frame);

 private:
  const Pixels pixels_;
  SwsContext* context_ = nullptr;
};

}  // namespace deepuav
