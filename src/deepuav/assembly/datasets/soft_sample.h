#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "deepuav/assembly/datasets/dataset_images.h"
#include "deepuav/assembly/settings/run_options.h"

namespace deepuav {

/// Frames of the range that tell how sharp images are: all over it, or, of images that can only be
/// had one after the other, `rate_hz` of them a second, from its first seconds.
std::vector<int> SoftSampleFrames(const FrameRange& range, int size,
                                  std::optional<double> rate_hz = {});

/// How many pixels count of the dataset's images where they are soft (PixelsOfSoftImages), by a few
/// of the range. Images that cannot be read are left to the run to tell. Throws Error where there
/// is no network.
std::optional<double> FindSoftPixels(const RunOptions& options, const FrameRange& range,
                                     const std::function<bool()>& stop, Dataset* dataset);

}  // namespace deepuav
