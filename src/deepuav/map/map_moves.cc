#include <algorithm>
#include <optional>
#include <vector>

#include "deepuav/map/map.h"

namespace deepuav {
namespace {

/// The camera seen from the keyframe once the keyframe has this scale.
SE3 InScale(const AnchoredPose& anchored, double scale) {
  const SE3& cam = anchored.cam_from_keyframe;
  return SE3(cam.rotation(), scale / anchored.keyframe_scale * cam.translation());
}

}  // namespace

void Map::Transform(const Sim3& new_from_old) {
  keyframes_.ForEach([&](Keyframe& keyframe) {
    keyframe.cam_from_world = new_from_old.MovePose(keyframe.cam_from_world);
    keyframe.scale *= new_from_old.scale();
  });
  landmarks_.ForEach([&](Landmark& landmark) {
    landmark.position_world = new_from_old * landmark.position_world;
    landmark.mean_view_direction = new_from_old.rotation() * landmark.mean_view_direction;
    landmark.normal_world = new_from_old.rotation() * landmark.normal_world;
    landmark.min_distance *= new_from_old.scale();
    landmark.max_distance *= new_from_old.scale();
  });
  CountMove();
}

void Map::MovePixels(const PixelMove& move) {
  keyframes_.ForEach([&](Keyframe& keyframe) {
    keyframe.frame.features = MovedFeatures(keyframe.frame.features, move);
  });
  landmarks_.ForEach([&](Landmark& landmark) {
    for (Observation& observation : landmark.observations)
      observation.measured.px = move(observation.measured.px);
    landmark.representative.measured.px = move(landmark.representative.measured.px);
  });
}

void Map::Move(KeyframeId id, const Sim3& new_from_old) {
  Keyframe& keyframe = keyframes_.At(id);
  keyframe.cam_from_world = new_from_old.MovePose(keyframe.cam_from_world);
  keyframe.scale *= new_from_old.scale();
}

void Map::Absorb(Map* other, KeyframeId parent) {
  const KeyframeId other_root = other->root_;
  keyframes_.TakeAll(&other->keyframes_);
  landmarks_.TakeAll(&other->landmarks_);
  culled_.merge(other->culled_);
  merged_into_.merge(other->merged_into_);
  SetParent(other_root, parent);
  other->root_ = {};
}

void Map::Rescale(double factor) {
  Transform(Sim3(factor, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()));
}

SE3 Map::PoseOf(const AnchoredPose& pose) const {
  const AnchoredPose anchored = OnRemaining(pose);
  const Keyframe& keyframe = keyframes_.At(anchored.keyframe);
  return InScale(anchored, keyframe.scale) * keyframe.cam_from_world;
}

AnchoredPose Map::OnRemaining(const AnchoredPose& pose) const {
  AnchoredPose anchored = pose;
  for (auto culled = culled_.find(anchored.keyframe); culled != culled_.end();
       culled = culled_.find(anchored.keyframe)) {
    const AnchoredPose& next = culled->second.pose;
    anchored = {next.keyframe, InScale(anchored, culled->second.scale) * next.cam_from_keyframe,
                next.keyframe_scale};
  }
  return anchored;
}

double Map::GrowthSince(const AnchoredPose& pose) const {
  double growth = 1, scale_then = pose.keyframe_scale;
  KeyframeId id = pose.keyframe;
  for (auto culled = culled_.find(id); culled != culled_.end(); culled = culled_.find(id)) {
    growth *= culled->second.scale / scale_then;
    id = culled->second.pose.keyframe;
    scale_then = culled->second.pose.keyframe_scale;
  }
  return growth * keyframes_.At(id).scale / scale_then;
}

KeyframeId Map::Remaining(KeyframeId id) const {
  for (auto culled = culled_.find(id); culled != culled_.end(); culled = culled_.find(id))
    id = culled->second.pose.keyframe;
  return id;
}

void Map::ForgetRemovedBut(const std::vector<KeyframeId>& keyframes,
                           const std::vector<LandmarkId>& landmarks) {
  for (const KeyframeId id : keyframes) {
    const auto found = culled_.find(id);
    if (found != culled_.end()) found->second.pose = OnRemaining(found->second.pose);
  }
  for (const LandmarkId id : landmarks) {
    const auto found = merged_into_.find(id);
    if (found != merged_into_.end()) found->second = Current(id).value_or(LandmarkId{});
  }
  std::erase_if(culled_, [&](const auto& entry) {
    return !std::binary_search(keyframes.begin(), keyframes.end(), entry.first);
  });
  std::erase_if(merged_into_, [&](const auto& entry) {
    return !entry.second.valid() ||
           !std::binary_search(landmarks.begin(), landmarks.end(), entry.first);
  });
}

}  // namespace deepuav
