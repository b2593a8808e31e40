#pragma once

#include <optional>

#include "deepuav/base/ids.h"
#include "deepuav/base/time.h"
#include "deepuav/image/image.h"

namespace deepuav {

struct TimedImage {
  FrameId id;
  Timestamp time;
  GreyImage image;
};

/// Where the images come from. One thread at a time.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  /// The next image that can be read, by growing id and time; nothing at the end.
  virtual std::optional<TimedImage> Next() = 0;
};

}  // namespace deepuav
