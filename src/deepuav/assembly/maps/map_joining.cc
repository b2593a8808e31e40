#include "deepuav/assembly/maps/map_joining.h"

#include <algorithm>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/map/all_keyframes.h"

namespace deepuav {
JoiningReport JoinMaps(const Camera& camera, const SystemOptions& options,
                       const Perception& perception, const std::vector<MapId>& newer,
                       Atlas* atlas) {
  if (!perception.vocabulary) throw Error("maps cannot be joined without a vocabulary");
  Mapper mapper(camera, options.mapping, atlas, nullptr);
  const PlaceMatchers matchers = perception.quick_matcher
                                     ? PlaceMatchers{perception.quick_matcher, perception.matcher}
                                     : PlaceMatchers{perception.matcher};
  PlaceMemory places(perception.vocabulary, options.looping.recogniser);
  LoopCloser loop_closer(camera, options.looping, options.tracking.locator, &places, matchers,
                         nullptr);
  for (MapId map : atlas->Remaining()) {
    if (std::find(newer.begin(), newer.end(), map) != newer.end()) continue;
    for (KeyframeId keyframe : AllKeyframes(atlas->At(map)))
      places.Remember(atlas->At(map).At(keyframe));
  }
  JoiningReport report;
  std::set<MapId> changed;
  for (MapId map : newer) {
    for (KeyframeId keyframe : AllKeyframes(atlas->At(map))) {
      if (!atlas->At(map).Contains(keyframe)) continue;
      const auto correction = loop_closer.Process(*atlas, atlas->At(map).id(), keyframe, {});
      places.Remember(atlas->At(map).At(keyframe));
      if (!correction) continue;
      Log().info("keyframe {} of map {} is at keyframe {} of map {}",
                 correction->ties.back().keyframe.value, correction->map.value,
                 correction->ties.back().place.value, correction->into.value);
      mapper.Apply(*correction);
      ++(correction->merges() ? report.merged_maps : report.closed_loops);
      changed.insert(correction->into);
    }
  }
  Pinhole pinhole = camera.pinhole;
  for (MapId map : atlas->Remaining()) {
    if (changed.contains(map)) mapper.AdjustGlobally(map, &pinhole, false);
  }
  return report;
}

}  // namespace deepuav
