#include "deepuav/map/map.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <utility>

#include "deepuav/base/median.h"

namespace deepuav {
namespace {

/// Or where it would be, of those of a landmark.
auto FindObservation(auto& observations, KeyframeId keyframe) {
  return std::lower_bound(observations.begin(), observations.end(), keyframe,
                          [](const Observation& o, KeyframeId id) { return o.keyframe < id; });
}

}  // namespace

int Keyframe::LandmarkCount() const {
  return static_cast<int>(
      std::count_if(landmarks.begin(), landmarks.end(), [](LandmarkId l) { return l.valid(); }));
}

void Map::AddKeyframe(KeyframeId id, const Frame& frame, const SE3& cam_from_world) {
  Keyframe& keyframe = keyframes_.Insert(id, Keyframe{});
  keyframe.id = id;
  keyframe.frame = frame;
  keyframe.cam_from_world = cam_from_world;
  keyframe.landmarks.resize(static_cast<size_t>(frame.features->size()));
  if (!root_.valid()) root_ = id;
}

void Map::ConnectToParent(KeyframeId id, KeyframeId fallback) {
  const std::vector<KeyframeId> best = Covisible(id, 1, 1);
  SetParent(id, best.empty() ? fallback : best.front());
}

void Map::SetParent(KeyframeId id, KeyframeId parent) {
  Keyframe& keyframe = keyframes_.At(id);
  if (keyframe.parent.valid()) keyframes_.At(keyframe.parent).children.erase(id);
  keyframe.parent = parent;
  if (parent.valid()) keyframes_.At(parent).children.insert(id);
}

void Map::Reroot(KeyframeId id) {
  KeyframeId above;  // the new parent of `next`
  for (KeyframeId next = id; next.valid();) {
    const KeyframeId old_parent = keyframes_.At(next).parent;
    SetParent(next, above);
    above = next;
    next = old_parent;
  }
  root_ = id;
}

void Map::AddLoop(KeyframeId a, KeyframeId b) {
  if (a == b) return;
  keyframes_.At(a).loops.insert(b);
  keyframes_.At(b).loops.insert(a);
}

void Map::RemoveKeyframe(KeyframeId id) {
  const Keyframe keyframe = keyframes_.At(id);
  for (LandmarkId landmark : keyframe.landmarks) {
    if (landmark.valid()) RemoveObservation(id, landmark);
  }
  Reparent(keyframe);
  for (KeyframeId other : keyframe.loops) {
    keyframes_.At(other).loops.erase(id);
    AddLoop(keyframe.parent, other);
  }
  const Keyframe& parent = keyframes_.At(keyframe.parent);
  culled_[id] = {
      {parent.id, keyframe.cam_from_world * parent.cam_from_world.Inverse(), parent.scale},
      keyframe.scale};
  keyframes_.Erase(id);
}

void Map::Reparent(const Keyframe& removed) {
  keyframes_.At(removed.parent).children.erase(removed.id);
  for (KeyframeId child : removed.children) {
    keyframes_.At(child).parent = removed.parent;
    keyframes_.At(removed.parent).children.insert(child);
  }
}

void Map::AddLandmark(LandmarkId id, const Eigen::Vector3d& position_world, KeyframeId created_by) {
  Landmark& landmark = landmarks_.Insert(id, Landmark{});
  landmark.id = id;
  landmark.position_world = position_world;
  landmark.created_by = created_by;
}

void Map::RemoveLandmark(LandmarkId id) {
  Landmark& landmark = landmarks_.At(id);
  while (!landmark.observations.empty()) {
    const Observation last = landmark.observations.back();
    landmark.observations.pop_back();
    ShiftCovisibility(landmark, last.keyframe, -1);
    keyframes_.At(last.keyframe).landmarks[static_cast<size_t>(last.keypoint)] = {};
  }
  landmarks_.Erase(id);
}

void Map::MergeLandmark(LandmarkId from, LandmarkId into) {
  if (from == into) return;
  const Landmark merged = landmarks_.At(from);
  RemoveLandmark(from);
  for (const Observation& observation : merged.observations) {
    AddObservation(observation.keyframe, observation.keypoint, into, observation.measured);
  }
  CountViews(into, merged.visible, merged.found);
  merged_into_[from] = into;
}

std::optional<LandmarkId> Map::Current(LandmarkId id) const {
  for (auto next = merged_into_.find(id); next != merged_into_.end(); next = merged_into_.find(id))
    id = next->second;
  if (!Contains(id)) return std::nullopt;
  return id;
}

bool Map::AddObservation(KeyframeId keyframe_id, int keypoint, LandmarkId landmark_id,
                         const std::optional<PixelMeasurement>& measured) {
  Keyframe& keyframe = keyframes_.At(keyframe_id);
  Landmark& landmark = landmarks_.At(landmark_id);
  LandmarkId& slot = keyframe.landmarks[static_cast<size_t>(keypoint)];
  const auto place = FindObservation(landmark.observations, keyframe_id);
  const bool seen = place != landmark.observations.end() && place->keyframe == keyframe_id;
  if (slot.valid() || seen) return false;
  ShiftCovisibility(landmark, keyframe_id, +1);
  const Keypoint& detected = keyframe.features().keypoints[static_cast<size_t>(keypoint)];
  const Observation added{keyframe_id, keypoint,
                          measured.value_or(PixelMeasurement{detected.px, detected.sigma_px})};
  landmark.observations.insert(place, added);
  if (!landmark.representative.keyframe.valid()) landmark.representative = added;
  slot = landmark_id;
  return true;
}

void Map::SetMeasurement(KeyframeId keyframe, LandmarkId landmark,
                         const PixelMeasurement& measured) {
  std::vector<Observation>& observations = landmarks_.At(landmark).observations;
  const auto place = FindObservation(observations, keyframe);
  assert(place != observations.end() && place->keyframe == keyframe);
  place->measured = measured;
}

void Map::RemoveObservation(KeyframeId keyframe_id, LandmarkId landmark_id) {
  Landmark& landmark = landmarks_.At(landmark_id);
  const auto place = FindObservation(landmark.observations, keyframe_id);
  if (place == landmark.observations.end() || place->keyframe != keyframe_id) return;
  keyframes_.At(keyframe_id).landmarks[static_cast<size_t>(place->keypoint)] = {};
  landmark.observations.erase(place);
  ShiftCovisibility(landmark, keyframe_id, -1);
  if (landmark.observations.size() < 2) {
    RemoveLandmark(landmark_id);
  } else if (landmark.representative.keyframe == keyframe_id) {
    landmark.representative = landmark.observations.front();
  }
}

void Map::ShiftCovisibility(const Landmark& landmark, KeyframeId keyframe_id, int change) {
  const auto shift = [change](std::map<KeyframeId, int>& covisible, KeyframeId id) {
    const auto entry = covisible.try_emplace(id, 0).first;
    entry->second += change;
    if (entry->second == 0) covisible.erase(entry);
  };
  for (const Observation& other : landmark.observations) {
    shift(keyframes_.At(keyframe_id).covisible, other.keyframe);
    shift(keyframes_.At(other.keyframe).covisible, keyframe_id);
  }
}

void Map::CountViews(LandmarkId id, int visible, int found) {
  Landmark& landmark = landmarks_.At(id);
  landmark.visible += visible;
  landmark.found += found;
}

void Map::UpdateViewRange(LandmarkId id) {
  Landmark& landmark = landmarks_.At(id);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  landmark.min_distance = std::numeric_limits<double>::max();
  landmark.max_distance = 0;
  for (const Observation& observation : landmark.observations) {
    const Eigen::Vector3d to_camera =
        keyframes_.At(observation.keyframe).cam_from_world.InverseTranslation() -
        landmark.position_world;
    const double distance = to_camera.norm();
    if (distance > 0) sum += to_camera / distance;
    landmark.min_distance = std::min(landmark.min_distance, distance);
    landmark.max_distance = std::max(landmark.max_distance, distance);
  }
  landmark.mean_view_direction = sum.normalized();
}

void Map::UpdateAppearance(LandmarkId id) {
  UpdateViewRange(id);
  Landmark& landmark = landmarks_.At(id);
  float best_similarity = -std::numeric_limits<float>::max();
  for (const Observation& observation : landmark.observations) {
    const Descriptors& descriptors = keyframes_.At(observation.keyframe).features().descriptors;
    float similarity = 0;
    for (const Observation& other : landmark.observations) {
      similarity += descriptors.Similarity(observation.keypoint,
                                           keyframes_.At(other.keyframe).features().descriptors,
                                           other.keypoint);
    }
    if (similarity > best_similarity) {
      best_similarity = similarity;
      landmark.representative = observation;
    }
  }
}

std::vector<KeyframeId> Map::Covisible(KeyframeId id, int min_shared, int max_count) const {
  std::vector<std::pair<int, KeyframeId>> weighted;
  for (const auto& [other, shared] : keyframes_.At(id).covisible) {
    if (shared >= min_shared) weighted.push_back({-shared, other});
  }
  std::sort(weighted.begin(), weighted.end());
  if (static_cast<int>(weighted.size()) > max_count)
    weighted.resize(static_cast<size_t>(max_count));
  std::vector<KeyframeId> ids;
  for (const auto& entry : weighted) ids.push_back(entry.second);
  return ids;
}

double Map::MedianDepth(KeyframeId id) const {
  const Keyframe& keyframe = keyframes_.At(id);
  std::vector<double> depths;
  for (LandmarkId landmark : keyframe.landmarks) {
    if (landmark.valid())
      depths.push_back((keyframe.cam_from_world * landmarks_.At(landmark).position_world).z());
  }
  return depths.empty() ? 0 : Median(std::move(depths));
}

}  // namespace deepuav
