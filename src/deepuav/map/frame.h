#pragma once

#include <memory>

#include "deepuav/base/ids.h"
#include "deepuav/base/time.h"
#include "deepuav/features/features.h"
#include "deepuav/image/image.h"

namespace deepuav {

/// One image as the rest of the system sees it. Const after extraction; copies share the features.
struct Frame {
  FrameId id;
  Timestamp time;
  std::shared_ptr<const Features> features;
  GreyImage image = {};  ///< Shared; empty once it is in the map.
};

}  // namespace deepuav
