#pragma once

#include <string>

#include "deepuav/features/features.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/image/image.h"

namespace deepuav {

/// Wall-clock seconds spent in the stages of one extraction.
struct ExtractionTimes {
  double network_s = 0;
  double postprocessing_s = 0;
};

/// Finds key points and describes them. One instance serves one camera and one thread at a time.
class Extractor {
 public:
  virtual ~Extractor() = default;

  /// `image` has the camera's size; throws Error otherwise. `times`, if given, is filled.
  virtual Features Extract(const GreyImage& image, ExtractionTimes* times = nullptr) = 0;

  /// Names the network and its weights' SHA-256 for summaries.
  virtual std::string Description() const = 0;
};

/// Finds key points in images of any size, through no lens: `px` is `image_px`. One thread at a
/// time.
class LenslessExtractor {
 public:
  virtual ~LenslessExtractor() = default;

  virtual Features Extract(const GreyImage& image) = 0;
};

}  // namespace deepuav
