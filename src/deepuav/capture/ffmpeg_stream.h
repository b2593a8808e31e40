#pragma once

#include <memory>
#include <string>

#include "deepuav/capture/live_source.h"

namespace deepuav {

/// The images of an address, as FFmpeg reads it. OpenCV's own use of FFmpeg takes all images to be
/// of the first one's size. Thread-compatible.
class FfmpegStream {
 public:
  /// Without an answer or an image for `timeout_s` it is given up, as once `stop` says true. Throws
  /// Error naming `name` where it cannot be opened.
  FfmpegStream(const std::string& address, const std::string& name, double timeout_s,
               const std::function<bool()>& stop);
  ~FfmpegStream();
  FfmpegStream(const FfmpegStream&) = delete;
  FfmpegStream& operator=(const FfmpegStream&) = delete;

  /// The next image that is whole; nothing at the end.
  std::optional<LiveImage> Next(const std::function<bool()>& stop);

 private:
  class Reader;
  std::unique_ptr<Reader> reader_;
};

}  // namespace deepuav
