#include "deepuav/map/local_map.h"

#include <algorithm>
#include <cmath>
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

/// How far the image of one camera is turned against that of another, about the viewing direction.
double HeadingDifferenceRad(const SE3& a_from_world, const SE3& b_from_world) {
  const Eigen::Matrix3d b_from_a =
      (b_from_world.rotation() * a_from_world.rotation().conjugate()).toRotationMatrix();
  return std::abs(std::atan2(b_from_a(1, 0) - b_from_a(0, 1), b_from_a(0, 0) + b_from_a(1, 1)));
}

/// The observation whose descriptor stands for the landmark: its representative, unless that saw it
/// turned too far to be recognised under the centre's heading and another did not.
Observation DescribedBy(const Map& map, const Landmark& landmark, const SE3& centre_from_world,
                        double max_heading_difference_rad) {
  const auto difference = [&](const Observation& observation) {
    return HeadingDifferenceRad(map.At(observation.keyframe).cam_from_world, centre_from_world);
  };
  Observation best = landmark.representative;
  double least = difference(best);
  if (least <= max_heading_difference_rad) return best;
  for (const Observation& observation : landmark.observations) {
    const double other = difference(observation);
    if (other < least) best = observation, least = other;
  }
  return best;
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
  LocalKeyframe copy{
      keyframe.id, keyframe.cam_from_world, keyframe.scale, keyframe.frame.features, {}};
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
  CheckOption(max_heading_difference_deg > 0, "mapping.local_map.max_heading_difference_deg",
              max_heading_difference_deg, "above 0");
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
  const SE3 centre_from_world = map.At(centre).cam_from_world;
  const double max_difference_rad = options.max_heading_difference_deg * M_PI / 180;
  for (LandmarkId id : landmarks) {
    const Landmark& landmark = map.At(id);
    local->landmarks.push_back(CopyLandmark(landmark));
    const Observation described = DescribedBy(map, landmark, centre_from_world, max_difference_rad);
    local->descriptors.AppendFrom(map.At(described.keyframe).features().descriptors,
                                  described.keypoint);
  }
  for (KeyframeId id : keyframes) local->keyframes.push_back(CopyKeyframe(map.At(id), landmarks));
  return local;
}

}  // namespace deepuav
