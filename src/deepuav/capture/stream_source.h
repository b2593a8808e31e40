#pragma once

#include <memory>
#include <opencv2/videoio.hpp>
#include <string>

#include "deepuav/capture/ffmpeg_stream.h"
#include "deepuav/capture/live_source.h"

namespace deepuav {

/// Whether it names a camera (/dev/video0) or an address (rtsp://, rtp://, udp://, http://, ...; a
/// session description flight.sdp), not a file or folder of images.
bool IsStreamAddress(const std::string& source);

/// An address without the user and password in it, and of what follows '?' only that there is some.
std::string WithoutSecrets(const std::string& address);

struct StreamOptions {
  double timeout_s = 5;             ///< Without an image for so long, the link counts as dropped.
  int width_px = 0, height_px = 0;  ///< Asked of a camera; 0: what it gives.
};

/// A camera, by OpenCV (V4L2), or an address, by FFmpeg. How long OpenCV waits for cameras is one
/// setting of the process, by the environment: the timeout of the first camera holds for all, and
/// it is to be made while no other thread reads the environment.
class StreamSource : public LiveSource {
 public:
  StreamSource(std::string address, const StreamOptions& options);

  void Open() override;
  std::optional<LiveImage> Next(const std::function<bool()>& stop) override;
  bool EndsForGood() const override { return false; }
  std::string Name() const override { return WithoutSecrets(address_); }

 private:
  void OpenDevice();
  std::optional<LiveImage> NextOfDevice();

  const std::string address_;
  const StreamOptions options_;
  const bool is_device_;
  cv::VideoCapture device_;
  cv::Mat read_;
  std::unique_ptr<FfmpegStream> stream_;
};

}  // namespace deepuav
