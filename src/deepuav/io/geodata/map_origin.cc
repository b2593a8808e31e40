#include "deepuav/io/geodata/map_origin.h"

namespace deepuav {

std::optional<int> FrameAt(const Dataset& dataset, Timestamp time) {
  int first = 0, end = dataset.size();
  while (first < end) {
    const int middle = first + (end - first) / 2;
    if (dataset.Time(middle) < time) {
      first = middle + 1;
    } else {
      end = middle;
    }
  }
  if (first == dataset.size() || dataset.Time(first) != time) return std::nullopt;
  return first;
}

void NameImages(const Atlas& atlas, const Dataset& dataset, ImageNames* image_names) {
  for (const MapId id : atlas.Remaining()) {
    atlas.At(id).keyframes().ForEach([&](const Keyframe& keyframe) {
      if (image_names->contains(keyframe.id)) return;
      if (const auto frame = FrameAt(dataset, keyframe.frame.time))
        (*image_names)[keyframe.id] = dataset.ImageName(*frame);
    });
  }
}

}  // namespace deepuav
