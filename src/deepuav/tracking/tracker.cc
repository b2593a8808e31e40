#include "deepuav/tracking/tracker.h"

#include <algorithm>

#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

const LocalKeyframe* FindKeyframe(const LocalMap& local_map, KeyframeId id) {
  for (const LocalKeyframe& keyframe : local_map.keyframes) {
    if (keyframe.id == id) return &keyframe;
  }
  return nullptr;
}

}  // namespace

void TrackingOptions::Check() const {
  CheckOptions("tracking", *this);
  locator.patches.Check();
  initialiser.Check();
  keyframes.Check();
}

Tracker::Tracker(const Camera& camera, const TrackingOptions& options, Matcher* matcher,
                 StageListener* stages)
    : options_(options),
      stages_(stages),
      initialiser_(camera, options.initialiser, options.locator.patches, matcher),
      locator_(camera, options.locator, matcher, stages),
      motion_(options.motion) {
  options_.Check();
}

TrackingResult Tracker::Track(const Frame& frame, bool mapping_idle) {
  motion_.Turn(frame.time, frame.turn_since_before);
  return state_ == TrackingState::kInitialising ? Initialise(frame)
                                                : TrackInMap(frame, mapping_idle);
}

TrackingResult Tracker::Initialise(const Frame& frame) {
  const StageScope stage(stages_, "initialise");
  TrackingResult result;
  if (!options_.starts_maps) {
    result.reason = "not found in a map";
    return result;
  }
  std::string waiting_for;
  result.initial_map = initialiser_.Add(frame, &waiting_for);
  if (!result.initial_map) result.reason = "waiting for " + waiting_for;
  return result;
}

TrackingResult Tracker::TrackInMap(const Frame& frame, bool mapping_idle) {
  std::string reason;
  const std::optional<LocatedFrame> located =
      locator_.Locate(frame, *local_map_, PriorFor(frame), &reason);
  if (!located) return Lost(frame, std::move(reason));

  state_ = TrackingState::kTracking;
  lost_frames_ = 0;
  last_time_ = frame.time;
  motion_.Update(frame.time, located->cam_from_world);
  CountViews(*located);

  TrackingResult result;
  result.state = state_;
  result.pose = last_ = PoseIn(*local_map_, *located);
  const auto since_keyframe = static_cast<int>(frame.id.value - last_keyframe_.value);
  if (mapping_idle && NeedsKeyframe(*located, *local_map_, since_keyframe, options_.keyframes)) {
    result.keyframe = RequestKeyframe(located->frame, *result.pose);
  }
  return result;
}

TrackingResult Tracker::Lost(const Frame& frame, std::string reason) {
  TrackingResult result;
  result.state = state_ = TrackingState::kLost;
  result.reason = std::move(reason);
  motion_.Lose();
  if (!last_time_) last_time_ = frame.time;
  const double lost_s = SecondsBetween(*last_time_, frame.time);
  if (++lost_frames_ <= options_.max_lost_frames && lost_s <= options_.max_lost_s) return result;
  initialiser_.Reset();
  result.state = state_ = TrackingState::kInitialising;
  if (!options_.starts_maps) return result;
  result.reason += "; starting a new map";
  std::string waiting_for;
  initialiser_.Add(frame, &waiting_for);
  return result;
}

void Tracker::Begin(std::shared_ptr<const LocalMap> local_map) {
  initialiser_.Reset();
  motion_.Reset();
  views_.clear();
  lost_frames_ = 0;
  last_.reset();
  last_time_.reset();
  last_keyframe_ = {};
  state_ = TrackingState::kTracking;
  local_map_ = std::move(local_map);
}

TrackingResult Tracker::Resume(const Frame& frame, std::shared_ptr<const LocalMap> local_map,
                               const LocatedFrame& located) {
  Begin(std::move(local_map));
  last_time_ = frame.time;
  motion_.Update(frame.time, located.cam_from_world);
  TrackingResult result;
  result.state = state_;
  result.pose = last_ = PoseIn(*local_map_, located);
  result.keyframe = RequestKeyframe(frame, *result.pose);
  return result;
}

void Tracker::UseLocalMap(std::shared_ptr<const LocalMap> local_map) {
  if (!local_map_) return;
  const bool in_other_map = local_map->map != local_map_->map;
  local_map_ = std::move(local_map);
  if (!last_) return;
  AnchoredPose& pose = last_->anchored;
  const LocalKeyframe* reference = FindKeyframe(*local_map_, pose.keyframe);
  if (!reference) {
    // In the world of another map what is known of the motion means nothing.
    if (in_other_map) motion_.Reset();
    return;
  }
  const double growth = reference->scale / pose.keyframe_scale;
  pose.cam_from_keyframe =
      SE3(pose.cam_from_keyframe.rotation(), growth * pose.cam_from_keyframe.translation());
  pose.keyframe_scale = reference->scale;
  motion_.Correct(pose.cam_from_keyframe * reference->cam_from_world, growth);
}

LocationPrior Tracker::PriorFor(const Frame& frame) const {
  LocationPrior prior;
  prior.cam_from_world = motion_.Predict(frame.time);
  prior.is_reckoned = motion_.is_lost();
  if (const auto& last = motion_.last_cam_from_world(); last && !motion_.is_lost())
    prior.neighbour = TimedPose{motion_.last_time(), last->Inverse()};
  if (!last_) return prior;
  prior.reference = last_->anchored.keyframe;
  for (const LandmarkMatch& match : last_->matches) prior.landmarks.push_back(match.landmark);
  return prior;
}

KeyframeRequest Tracker::RequestKeyframe(const Frame& frame, const TrackedPose& pose) {
  KeyframeRequest request{pose.map, frame, pose.anchored, pose.matches, {}};
  for (const auto& [id, count] : views_) request.views.push_back(count);
  views_.clear();
  last_keyframe_ = frame.id;
  return request;
}

void Tracker::CountViews(const LocatedFrame& located) {
  for (int index : located.visible) {
    const LandmarkId id = local_map_->landmarks[static_cast<size_t>(index)].id;
    ViewCount& count = views_.try_emplace(id, ViewCount{id, 0, 0}).first->second;
    ++count.visible;
  }
  for (const LocatedFrame::Seen& seen : located.seen) {
    const LandmarkId id = local_map_->landmarks[static_cast<size_t>(seen.landmark)].id;
    ViewCount& count = views_.try_emplace(id, ViewCount{id, 0, 0}).first->second;
    ++count.found;
    count.visible = std::max(count.visible, count.found);
  }
}

}  // namespace deepuav
