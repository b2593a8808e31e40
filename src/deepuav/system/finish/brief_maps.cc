#include "deepuav/system/finish/brief_maps.h"

#include <algorithm>

namespace deepuav {

BriefMaps::BriefMaps(Atlas* atlas, KeyframeId first_new_keyframe, double max_s)
    : atlas_(atlas), first_new_keyframe_(first_new_keyframe), max_s_(max_s) {}

void BriefMaps::SetAside(std::vector<FrameRecord>* records) {
  PutBack(records);
  lasting_.clear();
  FindBrief(*records);
  for (auto& [map, brief] : brief_) {
    std::map<FrameId, std::shared_ptr<const Features>> features;
    atlas_->At(map).keyframes().ForEach([&features](const Keyframe& keyframe) {
      features[keyframe.frame.id] = keyframe.frame.features;
    });
    for (const auto& [i, before] : brief.records) {
      FrameRecord lost;
      lost.id = before.id;
      lost.time = before.time;
      lost.reason = "only in a map that held for a moment";
      lost.keypoint_count = before.keypoint_count;
      lost.tracked_online = before.tracked_online;
      lost.motion = before.motion;
      lost.turn_is_measured = before.turn_is_measured;
      lost.features = before.features ? before.features : features[before.id];
      (*records)[i] = std::move(lost);
    }
  }
}

void BriefMaps::PutBack(std::vector<FrameRecord>* records) {
  for (auto& [map, brief] : brief_) {
    for (auto& [i, before] : brief.records) (*records)[i] = std::move(before);
  }
  brief_.clear();
}

int BriefMaps::Restore(const TrajectoryFinish& finish, const std::function<bool()>& stop,
                       Mapper* mapper, std::vector<FrameRecord>* records) {
  int given_up = 0;
  bool is_any_left = false;
  for (auto& [map, brief] : brief_) {
    bool is_empty = true;
    for (auto& [i, before] : brief.records) {
      FrameRecord& record = (*records)[i];
      if (record.located()) continue;
      record = std::move(before);
      record.map = map;  // of which another may have become a part
      record.cam_from_world = finish.RefinedPose(record);
      record.features.reset();
      is_empty = false;
    }
    is_any_left |= !is_empty;
    if (!is_empty) continue;
    mapper->GiveUp(map, brief.around);
    ++given_up;
  }
  if (is_any_left) finish.LocateLost(records, stop);
  brief_.clear();
  return given_up;
}

void BriefMaps::FindBrief(const std::vector<FrameRecord>& records) {
  std::map<MapId, std::vector<size_t>> frames;
  for (size_t i = 0; i < records.size(); ++i) {
    if (records[i].located()) frames[atlas_->Current(records[i].map)].push_back(i);
  }
  for (const auto& [map, places] : frames) {
    const double lasts_s =
        SecondsBetween(records[places.front()].time, records[places.back()].time);
    if (map == atlas_->BySize().front() || lasts_s > max_s_ || !IsNew(map)) lasting_.insert(map);
  }
  for (const auto& [map, places] : frames) {
    if (lasting_.contains(map)) continue;
    const MapId before = LastingBeside(records, places.front(), -1);
    const MapId after = LastingBeside(records, places.back(), +1);
    const MapId around = before.valid() ? before : after;
    if (!around.valid() || (after.valid() && after != around)) continue;
    Brief& brief = brief_[map];
    brief.around = around;
    for (const size_t i : places) brief.records.emplace_back(i, records[i]);
  }
}

bool BriefMaps::IsNew(MapId map) const {
  bool is_new = true;
  atlas_->At(map).keyframes().ForEach(
      [&](const Keyframe& keyframe) { is_new &= keyframe.id >= first_new_keyframe_; });
  return is_new;
}

MapId BriefMaps::LastingBeside(const std::vector<FrameRecord>& records, size_t i, int step) const {
  const auto count = std::ssize(records);
  for (auto k = static_cast<std::ptrdiff_t>(i) + step; k >= 0 && k < count; k += step) {
    const FrameRecord& record = records[static_cast<size_t>(k)];
    if (record.located() && lasting_.contains(atlas_->Current(record.map)))
      return atlas_->Current(record.map);
  }
  return {};
}

}  // namespace deepuav
