#include "work/match_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/io/files/atomic_file.h"

namespace deepuav {
namespace {

constexpr int kFractionalBits = 4;  // of the coordinates that OpenCV draws at
constexpr int kPointRadius = 2;

cv::Point Fixed(const Eigen::Vector2d& px) {
  constexpr double kOne = 1 << kFractionalBits;
  return {static_cast<int>(std::lround(px.x() * kOne)),
          static_cast<int>(std::lround(px.y() * kOne))};
}

/// From red over yellow to green.
cv::Scalar ColourOf(float score, double lowest_score) {
  constexpr double kFull = 255;
  const double share = (score - lowest_score) / std::max(1 - lowest_score, 1e-6);
  const double goodness = std::clamp(share, 0.0, 1.0);
  return {0, kFull * std::min(1.0, 2 * goodness), kFull * std::min(1.0, 2 - 2 * goodness)};
}

}  // namespace

void WriteMatchPicture(const std::filesystem::path& file, const std::filesystem::path& image_a,
                       const std::filesystem::path& image_b, const std::vector<PixelMatch>& matches,
                       int max_side_px, double lowest_score) {
  const ReducedImage a = LoadReduced(image_a, max_side_px), b = LoadReduced(image_b, max_side_px);
  cv::Mat3b picture(std::max(a.image.rows, b.image.rows), a.image.cols + b.image.cols,
                    cv::Vec3b(0, 0, 0));
  cv::Mat3b left = picture(cv::Rect({0, 0}, a.image.size()));
  cv::Mat3b right = picture(cv::Rect({a.image.cols, 0}, b.image.size()));
  cv::cvtColor(a.image, left, cv::COLOR_GRAY2BGR);
  cv::cvtColor(b.image, right, cv::COLOR_GRAY2BGR);
  const Eigen::Vector2d offset(a.image.cols, 0);
  // The best last, on top.
  for (auto match = matches.rbegin(); match != matches.rend(); ++match) {
    const cv::Point from = Fixed(a.FromOriginal(match->a_px));
    const cv::Point to = Fixed(b.FromOriginal(match->b_px) + offset);
    const cv::Scalar colour = ColourOf(match->score, lowest_score);
    cv::line(picture, from, to, colour, 1, cv::LINE_AA, kFractionalBits);
    for (const cv::Point& end : {from, to})
      cv::circle(picture, end, kPointRadius << kFractionalBits, colour, 1, cv::LINE_AA,
                 kFractionalBits);
  }
  std::vector<uint8_t> png;
  if (!cv::imencode(".png", picture, png))
    throw Error("{}: the picture cannot be encoded", file.string());
  WriteFileAtomically(file, {reinterpret_cast<const char*>(png.data()), png.size()});
}

}  // namespace deepuav
