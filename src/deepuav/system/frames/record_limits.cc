#include "deepuav/system/frames/record_limits.h"

#include <algorithm>
#include <utility>

namespace deepuav {

void RecordKeeper::Limit(std::vector<FrameRecord>* records) {
  CountInMap(records->back());
  LimitFeatures(records);
  ThinOld(records);
  ForgetOldest(records);
}

void RecordKeeper::End(std::vector<FrameRecord>* records) {
  // The last frame has no next one to wait for.
  if (records->empty() || last_is_young_) return;
  if (!SeesLittle(*records, records->size() - 1, limits_.min_neighbour_share))
    TakeAsSure(records->size() - 1, records);
}

void RecordKeeper::CountInMap(const FrameRecord& last) {
  if (last.located() && last.map != newest_map_) {
    newest_map_ = last.map;
    in_newest_map_ = 0;
  }
  if (last.located()) {
    ++in_newest_map_;
    begun_.emplace(last.map, last.time);
  }
  before_is_young_ =
      std::exchange(last_is_young_, last.located() && in_newest_map_ <= limits_.young_map_frames);
}

void RecordKeeper::LimitFeatures(std::vector<FrameRecord>* records) {
  const size_t last = records->size() - 1;
  // Only now both neighbours of the frame before are known.
  if (!before_is_young_ && !with_features_.empty() && with_features_.back() + 1 == last &&
      !SeesLittle(*records, last - 1, limits_.min_neighbour_share))
    TakeAsSure(last - 1, records);
  with_features_.push_back(last);
  if (static_cast<int>(with_features_.size()) > limits_.max_unlocated_frames) LetGoOfOne(records);
}

void RecordKeeper::LetGoOfOne(std::vector<FrameRecord>* records) {
  auto oldest = std::find_if(with_features_.begin(), with_features_.end(),
                             [records](size_t i) { return (*records)[i].is_sure; });
  if (oldest == with_features_.end()) oldest = with_features_.begin();
  (*records)[*oldest].features.reset();
  with_features_.erase(oldest);
}

void RecordKeeper::TakeAsSure(size_t i, std::vector<FrameRecord>* records) {
  FrameRecord& sure = (*records)[i];
  sure.is_sure = true;
  if (SecondsBetween(begun_.at(sure.map), sure.time) <= limits_.max_brief_s) return;
  std::erase_if(with_features_, [&](size_t k) {
    FrameRecord& record = (*records)[k];
    if (!record.is_sure || record.map != sure.map) return false;
    record.features.reset();
    return true;
  });
}

void RecordKeeper::ThinOld(std::vector<FrameRecord>* records) const {
  const auto newer = static_cast<size_t>(limits_.full_record_frames);
  if (records->size() > newer)
    Thin(limits_.old_record_landmarks, &(*records)[records->size() - 1 - newer]);
}

/// Of the older half every second.
void RecordKeeper::ForgetOldest(std::vector<FrameRecord>* records) {
  if (limits_.max_records <= 0 || records->size() <= static_cast<size_t>(limits_.max_records))
    return;
  const size_t older = records->size() / 2;
  // Without their neighbours they are not located any more.
  for (; !with_features_.empty() && with_features_.front() < older; with_features_.pop_front())
    (*records)[with_features_.front()].features.reset();
  size_t kept = 0;
  for (size_t i = 0; i < older; i += 2) {
    if (kept != i) (*records)[kept] = std::move((*records)[i]);
    ++kept;
  }
  const size_t removed = older - kept;
  records->erase(records->begin() + static_cast<std::ptrdiff_t>(kept),
                 records->begin() + static_cast<std::ptrdiff_t>(older));
  for (size_t& index : with_features_) index -= removed;
  forgotten_ += static_cast<int64_t>(removed);
}

}  // namespace deepuav
