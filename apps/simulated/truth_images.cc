#include "simulated/truth_images.h"

#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr double kFlowUnitsPerPx = 64, kFlowZero = 32768;
constexpr double kMost = std::numeric_limits<uint16_t>::max();

std::string Encode(const cv::Mat& image, const std::string& ending,
                   const std::vector<int>& parameters = {}) {
  std::vector<uchar> bytes;
  if (!cv::imencode(ending, image, bytes, parameters))
    throw Error("an image could not be encoded as {}", ending);
  return {bytes.begin(), bytes.end()};
}

uint16_t InUnits(double value) {
  return value >= 0 && value <= kMost ? static_cast<uint16_t>(std::lround(value)) : uint16_t{0};
}

}  // namespace

std::string EncodeImage(const GreyImage& image, const std::string& format, int jpeg_quality) {
  return format == "png" ? Encode(image, ".png")
                         : Encode(image, ".jpg", {cv::IMWRITE_JPEG_QUALITY, jpeg_quality});
}

std::string EncodeDepth(const cv::Mat1f& depth_m, double unit_m) {
  cv::Mat1w units(depth_m.size());
  for (int y = 0; y < units.rows; ++y) {
    for (int x = 0; x < units.cols; ++x) units(y, x) = InUnits(depth_m(y, x) / unit_m);
  }
  return Encode(units, ".png");
}

std::string EncodeMask(const cv::Mat1b& mask) { return Encode(mask, ".png"); }

std::string EncodeFlow(const cv::Mat2f& flow_px) {
  cv::Mat3w encoded(flow_px.size(), cv::Vec3w(0, 0, 0));  // OpenCV's order: blue, green, red
  for (int y = 0; y < encoded.rows; ++y) {
    for (int x = 0; x < encoded.cols; ++x) {
      const cv::Vec2f& flow = flow_px(y, x);
      const double u = kFlowUnitsPerPx * flow[0] + kFlowZero;
      const double v = kFlowUnitsPerPx * flow[1] + kFlowZero;
      if (u >= 0 && u <= kMost && v >= 0 && v <= kMost)  // not where a flow is no number
        encoded(y, x) = cv::Vec3w(1, InUnits(v), InUnits(u));
    }
  }
  return Encode(encoded, ".png");
}

}  // namespace deepuav
