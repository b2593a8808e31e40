#include "deepuav/evaluation/report/map_growth.h"

#include <algorithm>
#include <utility>

namespace deepuav {

MapGrowth GrowthOf(const Map& map) {
  std::vector<std::pair<KeyframeId, Timestamp>> keyframes;  // By id.
  map.keyframes().ForEach(
      [&](const Keyframe& keyframe) { keyframes.emplace_back(keyframe.id, keyframe.frame.time); });
  std::vector<Timestamp> births;
  map.landmarks().ForEach([&](const Landmark& landmark) {
    const auto after =
        std::upper_bound(keyframes.begin(), keyframes.end(), landmark.created_by,
                         [](KeyframeId id, const auto& keyframe) { return id < keyframe.first; });
    if (keyframes.empty()) return;
    births.push_back((after == keyframes.begin() ? after : after - 1)->second);
  });
  std::sort(births.begin(), births.end());
  MapGrowth growth;
  for (const auto& [id, time] : keyframes) growth.times.push_back(time);
  std::sort(growth.times.begin(), growth.times.end());
  for (const Timestamp time : growth.times) {
    growth.landmarks.push_back(
        static_cast<int>(std::upper_bound(births.begin(), births.end(), time) - births.begin()));
  }
  return growth;
}

}  // namespace deepuav
