#include "deepuav/features/moved_features.h"

namespace deepuav {

std::shared_ptr<const Features> MovedFeatures(const std::shared_ptr<const Features>& features,
                                              const PixelMove& move) {
  if (!features) return nullptr;
  auto moved = std::make_shared<Features>(*features);
  for (Keypoint& keypoint : moved->keypoints) keypoint.px = move(keypoint.px);
  return moved;
}

}  // namespace deepuav
