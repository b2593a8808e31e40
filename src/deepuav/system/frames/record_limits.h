#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <vector>

#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

/// What is kept of the frames so far; the options of the same names in SystemOptions.
struct RecordLimits {
  double min_neighbour_share = 0;
  int max_unlocated_frames = 0;
  int young_map_frames = 0;
  double max_brief_s = 0;
  int full_record_frames = 0;
  int old_record_landmarks = 0;
  int max_records = 0;  ///< 0: no limit.
};

/// Keeps the memory that the records of a run take small: features stay where the end of the run
/// may need them, of old frames less is known, and of very old ones only every second, fourth, ...
/// is. One instance a run.
class RecordKeeper {
 public:
  explicit RecordKeeper(const RecordLimits& limits) : limits_(limits) {}

  /// After every frame that was added to the records.
  void Limit(std::vector<FrameRecord>* records);
  /// After the last.
  void End(std::vector<FrameRecord>* records);
  /// Records that were taken out.
  int64_t forgotten() const { return forgotten_; }

 private:
  void LimitFeatures(std::vector<FrameRecord>* records);
  /// Counts the frames of the map that the last one is in.
  void CountInMap(const FrameRecord& last);
  /// Of those that are too many, first of one that is sure.
  void LetGoOfOne(std::vector<FrameRecord>* records);
  /// Notes that a record is sure; lets go of all that are and in its map, once that is no brief
  /// one.
  void TakeAsSure(size_t i, std::vector<FrameRecord>* records);
  void ThinOld(std::vector<FrameRecord>* records) const;
  void ForgetOldest(std::vector<FrameRecord>* records);

  const RecordLimits limits_;
  std::deque<size_t> with_features_;  ///< Records that keep their features, by growing index.
  std::map<MapId, Timestamp> begun_;  ///< When each map had its first frame.
  MapId newest_map_;
  int64_t in_newest_map_ = 0;                             ///< Frames, so far.
  bool last_is_young_ = false, before_is_young_ = false;  ///< Of the two latest records.
  int64_t forgotten_ = 0;
};

}  // namespace deepuav
