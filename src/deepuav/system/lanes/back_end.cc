#include "deepuav/system/lanes/back_end.h"

#include <algorithm>
#include <utility>

#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

/// The younger map becomes part of the older one, whichever of them was corrected.
MapEvent MergerOf(const MapCorrection& correction) {
  MapEvent event{MapChange::kMerged, correction.map, correction.into, correction.into_from_map};
  if (event.map < event.into) {
    std::swap(event.map, event.into);
    event.into_from_map = correction.into_from_map.Inverse();
  }
  return event;
}

}  // namespace

BackEnd::BackEnd(Atlas* atlas, Mapper* mapper, PlaceMemory* places, LoopCloser* loop_closer,
                 TurnedDescriber* turned, int adjustment_delay_keyframes, StageListener* stages)
    : atlas_(atlas),
      mapper_(mapper),
      places_(places),
      loop_closer_(loop_closer),
      turned_(turned),
      stages_(stages),
      adjustment_delay_keyframes_(adjustment_delay_keyframes) {}

void BackEnd::AdjustBeside(bool as_soon_as_ready) {
  adjust_beside_ = true;
  adjust_as_soon_as_ready_ = as_soon_as_ready;
}

LocalMapPtr BackEnd::StartMap(const InitialMapRequest& request) {
  LocalMapPtr local_map = mapper_->StartMap(request);
  if (!local_map) return local_map;
  TellOfMap({MapChange::kStarted, local_map->map, local_map->map});
  atlas_->At(local_map->map).keyframes().ForEach([&](const Keyframe& keyframe) {
    TellOfKeyframe(keyframe, local_map->map);
  });
  if (observer_) observer_->OnMapState(atlas_->At(local_map->map));
  if (!places_) return local_map;
  atlas_->At(local_map->map).keyframes().ForEach([this](const Keyframe& keyframe) {
    places_->Remember(keyframe);
  });
  return local_map;
}

void BackEnd::TellOfKeyframe(const Keyframe& keyframe, MapId map) const {
  if (observer_) observer_->OnKeyframe(EventOf(keyframe, atlas_->At(map)));
}

void BackEnd::TellOfMap(MapEvent event) const {
  if (!observer_) return;
  const Map& map = atlas_->At(event.into);
  event.revision = map.revision();
  observer_->OnMap(event);
  if (event.change == MapChange::kMerged)
    observer_->OnGauge(event.into, event.revision, atlas_->GaugeOf(event.into));
  if (event.change != MapChange::kStarted) observer_->OnMapState(map);
}

void BackEnd::StartAdjustment(MapId map) {
  adjustment_ = std::make_unique<PendingAdjustment>(mapper_->PrepareAdjustment(map), adjust_beside_,
                                                    stages_, stop_);
}

void BackEnd::FinishAdjustment() {
  if (!adjustment_) return;
  const bool due = ++adjustment_->keyframes_since >= adjustment_delay_keyframes_;
  if (adjust_as_soon_as_ready_ ? !adjustment_->Ready() : !due) return;
  ApplyAdjustment();
}

void BackEnd::ApplyAdjustment() {
  const std::unique_ptr<PendingAdjustment> finished = std::move(adjustment_);
  const GlobalAdjustment& adjustment = finished->Get();
  adjustment.Apply(&atlas_->At(adjustment.map()));
  const MapId map = atlas_->Current(adjustment.map());
  TellOfMap({MapChange::kAdjusted, map, map});
}

/// An adjustment of a map that is corrected knows nothing of the correction and is given up.
void BackEnd::SettleAdjustmentBefore(const MapCorrection& correction) {
  if (!adjustment_) return;
  const MapId map = atlas_->Current(adjustment_->map());
  const bool is_corrected = map == correction.map || map == correction.into;
  const bool would_wait = adjust_as_soon_as_ready_ && !adjustment_->Ready();
  if (is_corrected || would_wait) {
    adjustment_.reset();
  } else {
    ApplyAdjustment();
  }
}

LocalMapPtr BackEnd::InsertKeyframe(const KeyframeRequest& request) {
  FinishAdjustment();
  LocalMapPtr local_map = mapper_->InsertKeyframe(request);
  const auto centre = static_cast<size_t>(local_map->centre);
  newest_ = {local_map->map, local_map->keyframes[centre].id, request.frame};
  if (observer_) {
    TellOfKeyframe(atlas_->At(newest_->map).keyframes().At(newest_->keyframe), newest_->map);
    observer_->OnMapState(atlas_->At(newest_->map));
  }
  return local_map;
}

void BackEnd::CloseLoops() {
  if (!places_ || !newest_) return;
  const Newest newest = *std::exchange(newest_, std::nullopt);
  const std::optional<MapCorrection> correction = FindLoop(newest);
  {
    const StageScope stage(stages_, "remember place");
    places_->Remember(atlas_->At(newest.map).At(newest.keyframe));
  }
  if (correction) Correct(*correction);
}

std::optional<MapCorrection> BackEnd::FindLoop(const Newest& newest) {
  if (!loop_closer_) return std::nullopt;
  const TurnedDescriptors turned = DescribeTurned(newest);
  return loop_closer_->Process(*atlas_, newest.map, newest.keyframe, turned);
}

TurnedDescriptors BackEnd::DescribeTurned(const Newest& newest) const {
  if (!turned_ || !newest.frame.image) return TurnedDescriptors();
  const QuarterTurns turns = loop_closer_->TurnsFor(*atlas_, newest.map, newest.keyframe);
  if (turns == QuarterTurns{}) return TurnedDescriptors();
  const StageScope stage(stages_, "turned descriptors");
  return turned_->Describe(newest.frame.image->image(), *newest.frame.features, turns);
}

void BackEnd::Correct(const MapCorrection& correction) {
  const LoopTie& tie = correction.ties.back();
  const MapId whole = std::min(correction.map, correction.into);
  MapEvent event{MapChange::kLoopClosed, whole, whole};
  if (correction.merges()) {
    event = MergerOf(correction);
    Log().info("map {} joins map {}: keyframe {} is at keyframe {}", event.map.value, whole.value,
               tie.keyframe.value, tie.place.value);
    ++merged_maps_;
  } else {
    Log().info("loop closed in map {}: keyframe {} is at keyframe {}", whole.value,
               tie.keyframe.value, tie.place.value);
    ++closed_loops_;
  }
  SettleAdjustmentBefore(correction);
  mapper_->Apply(correction);
  TellOfMap(std::move(event));
  StartAdjustment(whole);
}

}  // namespace deepuav
