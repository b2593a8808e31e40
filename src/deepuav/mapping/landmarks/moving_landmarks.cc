#include "deepuav/mapping/landmarks/moving_landmarks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "deepuav/base/option_check.h"
#include "deepuav/map/all_keyframes.h"

namespace deepuav {
namespace {

/// Landmarks that are established, as the surroundings of others.
constexpr size_t kEstablishedObservations = 4;
constexpr size_t kAround = 6;

struct DepthInView {
  Eigen::Vector2f px;
  double depth;
  LandmarkId landmark;
};

double DepthIn(const Keyframe& keyframe, const Landmark& landmark) {
  return (keyframe.cam_from_world * landmark.position_world).z();
}

int CountByPatch(const Landmark& landmark) {
  return static_cast<int>(std::count_if(landmark.observations.begin(), landmark.observations.end(),
                                        [](const Observation& o) { return o.measured.by_patch; }));
}

class Judge {
 public:
  Judge(const Map& map, const MovingLandmarkOptions& options, const HoveringOptions& hovering)
      : map_(map),
        options_(options),
        hovering_(HoveringLandmarks(map, AllKeyframes(map), hovering)) {
    int64_t observations = 0, by_patch = 0;
    map.landmarks().ForEach([&](const Landmark& landmark) {
      observations += std::ssize(landmark.observations);
      by_patch += CountByPatch(landmark);
    });
    patches_tell_ = static_cast<double>(by_patch) >=
                    options.min_patch_share * static_cast<double>(observations);
  }

  bool SeemsToMove(const Landmark& landmark) {
    const bool few = std::ssize(landmark.observations) <= options_.few_observations;
    if (patches_tell_ && CountByPatch(landmark) == 0 &&
        (few || landmark.found < options_.min_found_ratio * landmark.visible))
      return true;
    if (few && StandsAlone(landmark)) return true;
    return std::ssize(landmark.observations) <= options_.few_hovering &&
           hovering_.contains(landmark.id);
  }

 private:
  /// In the view in the middle of those that saw it.
  bool StandsAlone(const Landmark& landmark) {
    const Observation& middle = landmark.observations[landmark.observations.size() / 2];
    const Keyframe& view = map_.At(middle.keyframe);
    const double depth = DepthIn(view, landmark);
    if (!(depth > 0)) return true;
    const Eigen::Vector2f& px = view.features().keypoints[static_cast<size_t>(middle.keypoint)].px;
    std::vector<std::pair<float, double>> around;  // Squared distance in the image, depth.
    for (const DepthInView& other : EstablishedIn(view)) {
      if (other.landmark != landmark.id)
        around.emplace_back((other.px - px).squaredNorm(), other.depth);
    }
    if (around.size() < kAround) return false;
    std::nth_element(around.begin(), around.begin() + (kAround - 1), around.end());
    return std::all_of(around.begin(), around.begin() + kAround, [&](const auto& other) {
      return std::abs(std::log(depth / other.second)) > options_.max_depth_step;
    });
  }

  const std::vector<DepthInView>& EstablishedIn(const Keyframe& view) {
    const auto [entry, is_new] = established_.try_emplace(view.id);
    if (!is_new) return entry->second;
    for (size_t i = 0; i < view.landmarks.size(); ++i) {
      if (!view.landmarks[i].valid()) continue;
      const Landmark& landmark = map_.At(view.landmarks[i]);
      const double depth = DepthIn(view, landmark);
      if (landmark.observations.size() >= kEstablishedObservations && depth > 0)
        entry->second.push_back({view.features().keypoints[i].px, depth, landmark.id});
    }
    return entry->second;
  }

  const Map& map_;
  const MovingLandmarkOptions& options_;
  const std::set<LandmarkId> hovering_;
  bool patches_tell_ = false;
  std::map<KeyframeId, std::vector<DepthInView>> established_;
};

}  // namespace

void MovingLandmarkOptions::Check() const { CheckOptions("mapping.moving", *this); }

int RemoveMoving(Map* map, const MovingLandmarkOptions& options, const HoveringOptions& hovering) {
  std::vector<LandmarkId> moving;
  Judge judge(*map, options, hovering);
  map->landmarks().ForEach([&](const Landmark& landmark) {
    if (judge.SeemsToMove(landmark)) moving.push_back(landmark.id);
  });
  for (const LandmarkId id : moving) map->RemoveLandmark(id);
  return static_cast<int>(moving.size());
}

void RemoveObservationsIn(const ImageRegion& region, Map* map) {
  std::vector<std::pair<KeyframeId, LandmarkId>> observations;
  map->keyframes().ForEach([&](const Keyframe& keyframe) {
    for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      if (keyframe.landmarks[i].valid() && region.Covers(keyframe.features().keypoints[i].image_px))
        observations.emplace_back(keyframe.id, keyframe.landmarks[i]);
    }
  });
  for (const auto& [keyframe, landmark] : observations) {
    if (map->Contains(landmark)) map->RemoveObservation(keyframe, landmark);
  }
}

}  // namespace deepuav
