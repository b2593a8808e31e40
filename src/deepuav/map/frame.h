#pragma once

#include <memory>

#include "deepuav/base/ids.h"
#include "deepuav/base/time.h"
#include "deepuav/features/features.h"
#include "deepuav/image/pyramid.h"

namespace deepuav {

/// One image as the rest of the system sees it. Const after extraction; copies share features and
/// image.
struct Frame {
  FrameId id;
  Timestamp time;
  std::shared_ptr<const Features> features;
  std::shared_ptr<const ImagePyramid> image = {};  ///< Null: not kept, as of older map files.
};

}  // namespace deepuav
