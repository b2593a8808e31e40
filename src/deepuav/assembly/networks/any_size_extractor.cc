#include "deepuav/assembly/networks/any_size_extractor.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace deepuav {
namespace {

constexpr size_t kSizesKept = 4;
constexpr double kFewestPixels = 1e4;  // As features.network_pixels, at least.

/// An image without a calibration: key points stay where they are.
Camera CameraOfSize(const cv::Size& size) {
  Camera camera;
  camera.width = size.width;
  camera.height = size.height;
  const double focal_px = std::max(size.width, size.height);
  camera.pinhole = {focal_px, focal_px, 0.5 * (size.width - 1), 0.5 * (size.height - 1)};
  return camera;
}

}  // namespace

Eigen::Array2d ReducedImage::OriginalOverReduced() const {
  return {static_cast<double>(original_size.width) / image.cols,
          static_cast<double>(original_size.height) / image.rows};
}

// Resizing keeps the edges of an image, which lie half a pixel outside the outermost centres.
Eigen::Vector2d ReducedImage::ToOriginal(const Eigen::Vector2f& px) const {
  return (px.cast<double>().array() + 0.5) * OriginalOverReduced() - 0.5;
}

Eigen::Vector2d ReducedImage::FromOriginal(const Eigen::Vector2d& px) const {
  return (px.array() + 0.5) / OriginalOverReduced() - 0.5;
}

ReducedImage LoadReduced(const std::filesystem::path& file, int max_side_px) {
  return Reduced(LoadGrey(file), max_side_px);
}

ReducedImage Reduced(const GreyImage& image, int max_side_px) {
  const int side = std::max(image.cols, image.rows);
  if (side <= max_side_px) return {image, image.size()};
  const double factor = static_cast<double>(max_side_px) / side;
  const auto reduced = [factor](int length) {
    return std::max(1, static_cast<int>(std::lround(factor * length)));
  };
  GreyImage small;
  cv::resize(image, small, cv::Size(reduced(image.cols), reduced(image.rows)), 0, 0,
             cv::INTER_AREA);
  return {small, image.size()};
}

AnySizeExtractor::Networks::Networks(const cv::Size& wanted_size, const SuperPointOptions& options,
                                     const InferenceOptions& inference)
    : size(wanted_size), upright(CameraOfSize(wanted_size), options, inference) {}

SuperPointOptions AnySizeExtractor::OptionsFor(const cv::Size& size) const {
  SuperPointOptions options = options_;
  if (seen_share_ > 0) options.network_pixels = std::max(kFewestPixels, seen_share_ * size.area());
  return options;
}

AnySizeExtractor::Networks& AnySizeExtractor::NetworksFor(const cv::Size& size) {
  const auto found = std::find_if(networks_.begin(), networks_.end(),
                                  [&](const Networks& one) { return one.size == size; });
  if (found != networks_.end()) {
    networks_.splice(networks_.begin(), networks_, found);
  } else {
    if (networks_.size() == kSizesKept) networks_.pop_back();
    networks_.emplace_front(size, OptionsFor(size), inference_);
  }
  return networks_.front();
}

Features AnySizeExtractor::Extract(const GreyImage& image) {
  return NetworksFor(image.size()).upright.Extract(image);
}

TurnedDescriptors AnySizeExtractor::DescribeTurned(const GreyImage& image,
                                                   const Features& features) {
  Networks& networks = NetworksFor(image.size());
  if (!networks.turned) {
    const SeenSize size(image.cols, image.rows, OptionsFor(image.size()).network_pixels);
    networks.turned.emplace(size, options_.model, inference_);
  }
  return networks.turned->Describe(image, features);
}

}  // namespace deepuav
