#include "deepuav/assembly/datasets/soft_sample.h"

#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/features/soft_images.h"

namespace deepuav {
namespace {

constexpr int kSampleImages = 6;
/// More than half of them are then in the air after a start from the ground, which is near and
/// out of focus.
constexpr double kVideoIntervalS = 2;

}  // namespace

std::vector<int> SoftSampleFrames(const FrameRange& range, int size,
                                  std::optional<double> rate_hz) {
  const int end = range.end < 0 ? size : std::min(range.end, size);
  const int run = 1 + (end - range.start - 1) / range.stride;  // Frames.
  const int count = std::min(kSampleImages, run);
  double step = static_cast<double>(run) / count;
  if (rate_hz) step = std::min(step, kVideoIntervalS * std::max(1.0, *rate_hz) / range.stride);
  std::vector<int> frames;
  for (int i = 0; i < count; ++i)
    frames.push_back(range.start +
                     range.stride * std::min(run - 1, static_cast<int>((i + 0.5) * step)));
  return frames;
}

std::optional<double> FindSoftPixels(const RunOptions& options, const FrameRange& range,
                                     const std::function<bool()>& stop, Dataset* dataset) {
  if (!options.features.reduce_soft) return std::nullopt;
  const Camera& camera = dataset->camera();
  const auto rate_hz =
      dataset->Kind() == "video" ? std::optional(camera.rate_hz) : std::optional<double>();
  std::vector<GreyImage> images;
  for (const int frame : SoftSampleFrames(range, dataset->size(), rate_hz)) {
    if (stop && stop()) return std::nullopt;
    try {
      images.push_back(dataset->Load(frame));
    } catch (const Error& error) {
      Log().debug("frame {} tells nothing of its sharpness: {}", frame, error.what());
    }
  }
  const auto pixels = PixelsOfSoftImages(images, options.features, options.inference);
  if (pixels)
    Log().info("the images are soft: the network sees {:.0f} of their {:.0f} pixels at most",
               *pixels, static_cast<double>(camera.width) * camera.height);
  return pixels;
}

}  // namespace deepuav
