#include "deepuav/map/local_map.h"

#include <algorithm>
#include <set>

#include "deepuav/base/options.h"

namespace deepuav {
namespace {

/// The centre first, then its neighbours by shared landmarks, then theirs.
std::vector<KeyframeId> Neighbourhood(const Map& map, KeyframeId centre,
                                      const LocalMapOptions& options) {
  std::vector<KeyframeId> ids = {centre};
  std::set<KeyframeId> taken = {centre};
  for (size_t i = 0; i < ids.size() && static_cast<int>(ids.size()) < options.max_keyframes; ++i) {
    for (KeyframeId other :
         map.Covisible(ids[i], options.min_shared_landmarks, options.max_keyframes)) {
      if (static_cast<int>(ids.size()) >= options.max_keyframes) break;
      if (taken.insert(other).second) ids.push_back(other);
    }
  }
  return ids;
}

std::vector<LandmarkId> LandmarksOf(const Map& map, const std::vector<KeyframeId>& keyframes,
                                    int max_landmarks) {
  std::set<LandmarkId> landmarks;
  for (KeyframeId id : keyframes) {
    for (LandmarkId landmark : map.At(id).landmarks) {
      if (landmark.valid() && static_cast<int>(landmarks.size()) < max_landmarks)
        landmarks.insert(landmark);
    }
  }
  return {landmarks.begin(), landmarks.end()};
}

LocalLandmark CopyLandmark(const Landmark& landmark) {
  return {landmark.id,
          landmark.position_world,
          landmark.mean_view_direction,
          landmark.min_distance,
          landmark.max_distance,
          static_cast<int>(landmark.observations.size())};
}

LocalKeyframe CopyKeyframe(const Keyframe& keyframe, const std::vector<LandmarkId>& landmarks) {
  LocalKeyframe copy{keyframe.id, keyframe.cam_from_world, keyframe.frame.features, {}};
  copy.landmarks.assign(keyframe.landmarks.size(), -1);
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (!keyframe.landmarks[i].valid()) continue;
    const auto place = std::lower_bound(landmarks.begin(), landmarks.end(), keyframe.landmarks[i]);
    if (place == landmarks.end() || *place != keyframe.landmarks[i]) continue;
    copy.landmarks[i] = static_cast<int>(place - landmarks.begin());
  }
  return copy;
}

}  // namespace

void LocalMapOptions::Check() const {
  CheckOption(max_keyframes >= 2, "mapping.local_map.max_keyframes", max_keyframes, "at least 2");
  CheckOption(min_shared_landmarks >= 1, "mapping.local_map.min_shared_landmarks",
              min_shared_landmarks, "at least 1");
  CheckOption(max_landmarks >= 100, "mapping.local_map.max_landmarks", max_landmarks,
              "at least 100");
}

std::shared_ptr<const LocalMap> MakeLocalMap(const Map& map, KeyframeId centre,
                                             const LocalMapOptions& options) {
  std::vector<KeyframeId> keyframes = Neighbourhood(map, centre, options);
  const std::vector<LandmarkId> landmarks = LandmarksOf(map, keyframes, options.max_landmarks);
  std::sort(keyframes.begin(), keyframes.end());

  auto local = std::make_shared<LocalMap>();
  local->map = map.id();
  local->centre =
      static_cast<int>(std::find(keyframes.begin(), keyframes.end(), centre) - keyframes.begin());
  local->descriptors = Descriptors(map.At(centre).features().descriptors.dimension());
  local->descriptors.Reserve(static_cast<int>(landmarks.size()));
  local->landmarks.reserve(landmarks.size());
  for (LandmarkId id : landmarks) {
    const Landmark& landmark = map.At(id);
    local->landmarks.push_back(CopyLandmark(landmark));
    local->descriptors.AppendFrom(map.At(landmark.representative.keyframe).features().descriptors,
                                  landmark.representative.keypoint);
  }
  for (KeyframeId id : keyframes) local->keyframes.push_back(CopyKeyframe(map.At(id), landmarks));
  return local;
}

}  // namespace deepuav
