#include "deepuav/capture/stream_source.h"

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr std::string_view kDevices = "/dev/";
constexpr std::string_view kScheme = "://";
constexpr std::string_view kDescription = ".sdp";

/// By the code of the container, or the first letters of FFmpeg's own name.
bool IsJpeg(double fourcc) {
  const auto code = static_cast<int>(fourcc);
  return code == cv::VideoWriter::fourcc('M', 'J', 'P', 'G') ||
         code == cv::VideoWriter::fourcc('m', 'j', 'p', 'e');
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
    : address_(std::move(address)), options_(options), is_device_(address_.starts_with(kDevices)) {}

bool StreamSource::OpenAddress(bool packets) {
  const int timeout_ms = static_cast<int>(std::lround(1e3 * options_.timeout_s));
  std::vector<int> parameters = {cv::CAP_PROP_OPEN_TIMEOUT_MSEC, timeout_ms,
                                 cv::CAP_PROP_READ_TIMEOUT_MSEC, timeout_ms};
  if (packets) parameters.insert(parameters.end(), {cv::CAP_PROP_FORMAT, -1});
  const bool opened = capture_.open(address_, cv::CAP_FFMPEG, parameters);
  // Calibrations are in the sensor's pixels.
  if (opened && !packets) capture_.set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
  return opened;
}

bool StreamSource::TryOpen() {
  try {
    capture_.release();
    if (is_device_) {
      if (!capture_.open(address_, cv::CAP_V4L2)) return false;
      if (options_.width_px > 0) {
        capture_.set(cv::CAP_PROP_FRAME_WIDTH, options_.width_px);
        capture_.set(cv::CAP_PROP_FRAME_HEIGHT, options_.height_px);
      }
      capture_.set(cv::CAP_PROP_BUFFERSIZE, 1);
      return true;
    }
    if (!OpenAddress(is_jpeg_)) return false;
    if (is_jpeg_ || !IsJpeg(capture_.get(cv::CAP_PROP_FOURCC))) return true;
    is_jpeg_ = true;
    return OpenAddress(is_jpeg_);
  } catch (const cv::Exception&) {
    return false;
  }
}

void StreamSource::Open() {
  if (!TryOpen())
    throw Error("{}: cannot be opened: expected a {} that gives images", Name(),
                is_device_ ? "camera" : "stream");
}

std::optional<LiveImage> StreamSource::Next(const std::function<bool()>& stop) {
  if (stop && stop()) return std::nullopt;
  try {
    while (capture_.read(read_) && !read_.empty()) {
      LiveImage next;
      if (is_jpeg_) {
        next.image = cv::imdecode(read_, cv::IMREAD_GRAYSCALE);
        if (next.image.empty()) continue;  // One was damaged on the way.
      } else if (read_.channels() == 1) {
        next.image = read_.clone();
      } else {
        cv::cvtColor(read_, next.image, cv::COLOR_BGR2GRAY);
      }
      const double ms = capture_.get(cv::CAP_PROP_POS_MSEC);
      if (std::isfinite(ms)) next.stream_time = Timestamp{std::llround(1e6 * ms)};
      return next;
    }
  } catch (const cv::Exception&) {  // As good as a link that dropped.
  }
  return std::nullopt;
}

}  // namespace deepuav
