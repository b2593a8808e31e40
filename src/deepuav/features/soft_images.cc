#include "deepuav/features/soft_images.h"

#include <algorithm>

#include "deepuav/base/median.h"

namespace deepuav {
namespace {

/// Larger images, which hardly anyone works on, would take memory for a question.
constexpr double kMostPixels = 1e6;
/// Below, no network finds its way.
constexpr double kFewestPixels = 2e4;
/// Where it finds fewer it sees nothing, at any size.
constexpr double kFewestKeypoints = 20;

/// Of key points that pass the threshold, in the median, in images seen at so many pixels.
double KeypointCount(const std::vector<GreyImage>& images, double pixels, SuperPointOptions options,
                     const InferenceOptions& inference) {
  Camera camera;
  camera.width = images.front().cols;
  camera.height = images.front().rows;
  camera.pinhole.fx = camera.pinhole.fy = camera.width;
  options.network_pixels = pixels;
  options.faint_keypoints = 0;
  SuperPoint extractor(camera, options, inference);
  std::vector<double> counts;
  for (const GreyImage& image : images) counts.push_back(extractor.Extract(image).size());
  return Median(std::move(counts));
}

}  // namespace

std::optional<double> PixelsOfSoftImages(const std::vector<GreyImage>& images,
                                         const SuperPointOptions& options,
                                         const InferenceOptions& inference) {
  if (images.empty()) return std::nullopt;
  const double all = static_cast<double>(images.front().cols) * images.front().rows;
  const double first = std::min(all, kMostPixels);
  if (first < kFewestPixels) return std::nullopt;
  double best = first, most = KeypointCount(images, first, options, inference);
  if (most >= options.keypoints) return std::nullopt;
  for (double pixels = first / 2; pixels >= kFewestPixels; pixels /= 2) {
    const double count = KeypointCount(images, pixels, options, inference);
    if (count <= most || count < kFewestKeypoints) break;
    best = pixels;
    most = count;
  }
  return best < first ? std::optional(best) : std::nullopt;
}

}  // namespace deepuav
