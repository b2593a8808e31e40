#include <algorithm>
#include <cmath>
#include <optional>

#include "deepuav/base/error.h"
#include "deepuav/map/map.h"
#include "deepuav/map/map_state.h"

namespace deepuav {
namespace {

constexpr double kUnitTolerance = 1e-9;

template <typename Thing>
void CheckRisingIds(const std::vector<Thing>& things, const char* kind) {
  for (size_t i = 0; i < things.size(); ++i) {
    const auto id = things[i].id;
    if (!id.valid() || (i > 0 && id <= things[i - 1].id)) {
      throw Error("{} {} follows {}: expected rising ids from 0", kind, id.value,
                  i > 0 ? things[i - 1].id.value : -1);
    }
  }
}

void CheckPose(const SE3& pose, KeyframeId id) {
  if (!pose.translation().allFinite() ||
      !(std::abs(pose.rotation().squaredNorm() - 1) < kUnitTolerance)) {
    throw Error("keyframe {} has no pose: expected a finite one with a unit quaternion", id.value);
  }
}

void CheckScale(double scale, KeyframeId id) {
  if (!(scale > 0) || !std::isfinite(scale))
    throw Error("keyframe {} has the scale {}: expected a finite one above 0", id.value, scale);
}

void CheckFeatures(const Keyframe& keyframe, int dimension) {
  const Features& features = keyframe.features();
  if (features.size() != features.descriptors.size() ||
      features.descriptors.dimension() != dimension) {
    throw Error(
        "keyframe {} has {} key points and {} descriptors of dimension {}: expected as many, of "
        "dimension {}",
        keyframe.id.value, features.size(), features.descriptors.size(),
        features.descriptors.dimension(), dimension);
  }
  for (const Keypoint& keypoint : features.keypoints) {
    const bool usable = keypoint.image_px.allFinite() && keypoint.px.allFinite() &&
                        std::isfinite(keypoint.score) && std::isfinite(keypoint.sigma_px) &&
                        keypoint.sigma_px > 0;
    if (!usable)
      throw Error("keyframe {} has a key point with values that cannot be", keyframe.id.value);
  }
}

void CheckKeyframes(const std::vector<Keyframe>& keyframes) {
  CheckRisingIds(keyframes, "keyframe");
  for (const Keyframe& keyframe : keyframes) {
    if (!keyframe.frame.id.valid() || !keyframe.frame.features) {
      throw Error("keyframe {} has no frame", keyframe.id.value);
    }
    CheckPose(keyframe.cam_from_world, keyframe.id);
    CheckScale(keyframe.scale, keyframe.id);
    CheckFeatures(keyframe, keyframes.front().features().descriptors.dimension());
  }
}

/// An id from which following `next` leads back to it; nothing where all chains end.
template <typename IdType>
std::optional<IdType> FindCycle(const std::map<IdType, IdType>& next) {
  std::map<IdType, IdType> first_walk_by;  // ids passed, and where the walk had started
  for (const auto& entry : next) {
    const IdType start = entry.first;
    for (auto step = next.find(start); step != next.end(); step = next.find(step->second)) {
      const auto [passed, is_new] = first_walk_by.try_emplace(step->first, start);
      if (!is_new && passed->second == start) return step->first;
      if (!is_new) break;
    }
  }
  return std::nullopt;
}

void CheckSpanningTree(const IdStore<KeyframeId, Keyframe>& keyframes) {
  std::map<KeyframeId, KeyframeId> parents;
  std::vector<KeyframeId> roots;
  keyframes.ForEach([&](const Keyframe& keyframe) {
    if (!keyframe.parent.valid()) return roots.push_back(keyframe.id);
    if (!keyframes.Contains(keyframe.parent)) {
      throw Error("keyframe {} has the parent {}: expected a keyframe of the map",
                  keyframe.id.value, keyframe.parent.value);
    }
    parents[keyframe.id] = keyframe.parent;
  });
  if (const auto id = FindCycle(parents))
    throw Error("keyframe {} is its own ancestor: expected a tree", id->value);
  if (roots.size() > 1) {
    throw Error("keyframes {} and {} have no parent: expected one root", roots[0].value,
                roots[1].value);
  }
}

void CheckLoops(const IdStore<KeyframeId, Keyframe>& keyframes) {
  keyframes.ForEach([&](const Keyframe& keyframe) {
    for (KeyframeId other : keyframe.loops) {
      if (other == keyframe.id || !keyframes.Contains(other) ||
          !keyframes.At(other).loops.contains(keyframe.id)) {
        throw Error("keyframe {} closes a loop with {}: expected another of the map, both ways",
                    keyframe.id.value, other.value);
      }
    }
  });
}

void CheckCulled(const std::map<KeyframeId, CulledKeyframe>& culled,
                 const IdStore<KeyframeId, Keyframe>& keyframes) {
  std::map<KeyframeId, KeyframeId> parents;
  for (const auto& [id, culled_keyframe] : culled) {
    const AnchoredPose& pose = culled_keyframe.pose;
    CheckPose(pose.cam_from_keyframe, id);
    CheckScale(culled_keyframe.scale, id);
    CheckScale(pose.keyframe_scale, id);
    if (!id.valid() || keyframes.Contains(id))
      throw Error("keyframe {} was removed and is there", id.value);
    if (!keyframes.Contains(pose.keyframe) && !culled.contains(pose.keyframe)) {
      throw Error("removed keyframe {} hangs on {}: expected a keyframe of the map", id.value,
                  pose.keyframe.value);
    }
    parents[id] = pose.keyframe;
  }
  if (const auto id = FindCycle(parents))
    throw Error("removed keyframe {} hangs on itself", id->value);
}

void CheckMerged(const std::map<LandmarkId, LandmarkId>& merged_into,
                 const IdStore<LandmarkId, Landmark>& landmarks) {
  for (const auto& [from, into] : merged_into) {
    if (!from.valid() || !into.valid() || landmarks.Contains(from)) {
      throw Error("landmark {} was merged into {}: expected one that is gone into another",
                  from.value, into.value);
    }
  }
  if (const auto id = FindCycle(merged_into))
    throw Error("landmark {} was merged into itself", id->value);
}

/// What holds for the landmark alone.
void CheckLandmark(const Landmark& landmark) {
  const bool finite = landmark.position_world.allFinite() &&
                      landmark.mean_view_direction.allFinite() &&
                      landmark.normal_world.allFinite() && std::isfinite(landmark.min_distance) &&
                      std::isfinite(landmark.max_distance);
  if (!finite) throw Error("landmark {} has values that are not finite", landmark.id.value);
  if (landmark.visible < 0 || landmark.found < 0) {
    throw Error("landmark {} was found {} times of {}: expected counts", landmark.id.value,
                landmark.found, landmark.visible);
  }
  const Observation& representative = landmark.representative;
  const bool is_observed = std::any_of(landmark.observations.begin(), landmark.observations.end(),
                                       [&](const Observation& observation) {
                                         return observation.keyframe == representative.keyframe &&
                                                observation.keypoint == representative.keypoint;
                                       });
  const bool is_none = representative.keyframe == KeyframeId{} && representative.keypoint == 0;
  if (!is_observed && !(landmark.observations.empty() && is_none)) {
    throw Error(
        "landmark {} is represented by key point {} of keyframe {}: expected one of its "
        "observations",
        landmark.id.value, representative.keypoint, representative.keyframe.value);
  }
}

}  // namespace

Map Map::Restore(MapState state) {
  CheckKeyframes(state.keyframes);
  CheckRisingIds(state.landmarks, "landmark");
  if (!(state.model_sigma_px >= 0) || !std::isfinite(state.model_sigma_px)) {
    throw Error("the map's model noise is {} px: expected a finite one of at least 0",
                state.model_sigma_px);
  }
  Map map(state.id);
  map.model_sigma_px_ = state.model_sigma_px;
  for (Keyframe& keyframe : state.keyframes) {
    keyframe.landmarks.assign(static_cast<size_t>(keyframe.features().size()), LandmarkId{});
    keyframe.covisible.clear();
    keyframe.children.clear();
    map.keyframes_.Insert(keyframe.id, std::move(keyframe));
  }
  CheckSpanningTree(map.keyframes_);
  CheckLoops(map.keyframes_);
  map.keyframes_.ForEach([&](const Keyframe& keyframe) {
    if (keyframe.parent.valid()) {
      map.keyframes_.At(keyframe.parent).children.insert(keyframe.id);
    } else {
      map.root_ = keyframe.id;
    }
  });
  for (Landmark& landmark : state.landmarks) map.RestoreLandmark(std::move(landmark));
  map.RestoreCovisibility();
  CheckCulled(state.culled, map.keyframes_);
  CheckMerged(state.merged_into, map.landmarks_);
  map.culled_ = std::move(state.culled);
  map.merged_into_ = std::move(state.merged_into);
  return map;
}

void Map::RestoreLandmark(Landmark landmark) {
  CheckLandmark(landmark);
  KeyframeId last;
  for (const Observation& observation : landmark.observations) {
    Keyframe* keyframe = keyframes_.Find(observation.keyframe);
    const auto keypoint = static_cast<size_t>(observation.keypoint);
    const bool is_free = keyframe && observation.keypoint >= 0 &&
                         keypoint < keyframe->landmarks.size() &&
                         !keyframe->landmarks[keypoint].valid();
    if (!is_free || observation.keyframe <= last) {
      throw Error(
          "landmark {} is observed at key point {} of keyframe {}: expected one free, by rising "
          "keyframe",
          landmark.id.value, observation.keypoint, observation.keyframe.value);
    }
    if (!observation.measured.px.allFinite() || !observation.measured.noise.usable()) {
      throw Error("landmark {} has no place in keyframe {}: expected a finite one with a noise",
                  landmark.id.value, observation.keyframe.value);
    }
    keyframe->landmarks[keypoint] = landmark.id;
    last = observation.keyframe;
  }
  landmarks_.Insert(landmark.id, std::move(landmark));
}

/// Counts over the landmarks of one keyframe at a time: far cheaper than pair by pair.
void Map::RestoreCovisibility() {
  std::vector<KeyframeId> ids;
  keyframes_.ForEach([&](const Keyframe& keyframe) { ids.push_back(keyframe.id); });
  std::vector<int> shared(ids.empty() ? 0 : static_cast<size_t>(ids.back().value) + 1, 0);  // by id
  const auto count = [&](KeyframeId id) -> int& { return shared[static_cast<size_t>(id.value)]; };
  keyframes_.ForEach([&](Keyframe& keyframe) {
    for (LandmarkId landmark : keyframe.landmarks) {
      if (!landmark.valid()) continue;
      for (const Observation& other : landmarks_.At(landmark).observations) ++count(other.keyframe);
    }
    count(keyframe.id) = 0;
    for (KeyframeId id : ids) {
      if (count(id) > 0) keyframe.covisible.emplace_hint(keyframe.covisible.end(), id, count(id));
      count(id) = 0;
    }
  });
}

}  // namespace deepuav
