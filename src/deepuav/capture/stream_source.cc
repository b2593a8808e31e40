#include "deepuav/capture/stream_source.h"

#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr std::string_view kDevices = "/dev/";
constexpr std::string_view kScheme = "://";
constexpr std::string_view kDescription = ".sdp";

/// OpenCV waits for an image of a device as many seconds as this says when the first is waited for.
void WaitForDevices(double timeout_s) {
  constexpr int kUnlessSet = 0;
  const std::string seconds = std::to_string(std::max(1L, std::lround(std::ceil(timeout_s))));
  ::setenv("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", seconds.c_str(), kUnlessSet);
}

}  // namespace

bool IsStreamAddress(const std::string& source) {
  return source.starts_with(kDevices) || source.find(kScheme) != std::string::npos ||
         source.ends_with(kDescription);
}

std::string WithoutSecrets(const std::string& address) {
  const size_t scheme = address.find(kScheme);
  if (scheme == std::string::npos) return address;
  const size_t host = scheme + kScheme.size();
  const size_t path = std::min(address.find_first_of("/?#", host), address.size());
  const size_t at = address.rfind('@', path);
  const bool has_user = at != std::string::npos && at >= host && at < path;
  std::string shown = address.substr(0, host) + address.substr(has_user ? at + 1 : host);
  const size_t query = shown.find('?');
  if (query != std::string::npos) shown.replace(query, std::string::npos, "?...");
  return shown;
}

StreamSource::StreamSource(std::string address, const StreamOptions& options)
    : address_(std::move(address)), options_(options), is_device_(address_.starts_with(kDevices)) {
  if (is_device_) WaitForDevices(options_.timeout_s);
}

void StreamSource::OpenDevice() {
  try {
    device_.release();
    if (!device_.open(address_, cv::CAP_V4L2))
      throw Error("{}: cannot be opened: expected a camera that gives images", address_);
    if (options_.width_px > 0) {
      device_.set(cv::CAP_PROP_FRAME_WIDTH, options_.width_px);
      device_.set(cv::CAP_PROP_FRAME_HEIGHT, options_.height_px);
    }
    device_.set(cv::CAP_PROP_BUFFERSIZE, 1);
  } catch (const cv::Exception& error) {
    throw Error("{}: cannot be opened: {}", address_, error.err);
  }
}

void StreamSource::Open() {
  if (is_device_) return OpenDevice();
  stream_.reset();
  stream_ = std::make_unique<FfmpegStream>(address_, Name(), options_.timeout_s, nullptr);
}

std::optional<LiveImage> StreamSource::NextOfDevice() {
  try {
    if (!device_.read(read_) || read_.empty()) return std::nullopt;
    LiveImage next;
    if (read_.channels() == 1) {
      next.image = read_.clone();
    } else {
      cv::cvtColor(read_, next.image, cv::COLOR_BGR2GRAY);
    }
    const double ms = device_.get(cv::CAP_PROP_POS_MSEC);
    if (std::isfinite(ms) && ms > 0) next.stream_time = Timestamp{std::llround(1e6 * ms)};
    return next;
  } catch (const cv::Exception&) {
    return std::nullopt;  // As good as a link that dropped.
  }
}

std::optional<LiveImage> StreamSource::Next(const std::function<bool()>& stop) {
  if (stop && stop()) return std::nullopt;
  if (is_device_) return NextOfDevice();
  return stream_ ? stream_->Next(stop) : std::nullopt;
}

}  // namespace deepuav
