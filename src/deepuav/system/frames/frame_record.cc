#include "deepuav/system/frames/frame_record.h"

#include <algorithm>
#include <utility>

namespace deepuav {

FrameRecord MakeRecord(const Frame& frame, const TrackingResult& result) {
  FrameRecord record;
  record.keypoint_count = frame.features->size();
  record.id = frame.id;
  record.time = frame.time;
  record.state = result.state;
  record.reason = result.reason;
  record.features = frame.features;
  record.motion = frame.motion;
  record.turn_is_measured = frame.turn_is_measured;
  if (!result.pose) return record;
  record.tracked_online = true;
  record.map = result.pose->map;
  record.pose = result.pose->anchored;
  record.cam_from_world = result.pose->cam_from_world;
  record.map_revision = result.pose->map_revision;
  record.pose_information = result.pose->information;
  record.seen_motion = result.pose->motion;
  record.landmark_count = static_cast<int>(result.pose->matches.size());
  record.seen.reserve(result.pose->matches.size());
  for (const LandmarkMatch& match : result.pose->matches) {
    const Keypoint& keypoint = frame.features->keypoints[static_cast<size_t>(match.keypoint)];
    record.seen.push_back({match.landmark, match.measured.value_or(
                                               PixelMeasurement{keypoint.px, keypoint.sigma_px})});
  }
  return record;
}

void MovePixels(const PixelMove& move, FrameRecord* record) {
  record->features = MovedFeatures(record->features, move);
  for (FrameRecord::Seen& seen : record->seen) seen.measured.px = move(seen.measured.px);
}

FrameRecord WithoutWhatItSaw(const FrameRecord& record) {
  FrameRecord bare;
  bare.id = record.id;
  bare.time = record.time;
  bare.state = record.state;
  bare.reason = record.reason;
  bare.keypoint_count = record.keypoint_count;
  bare.tracked_online = record.tracked_online;
  bare.reckoned = record.reckoned;
  bare.inferred = record.inferred;
  bare.map = record.map;
  bare.pose = record.pose;
  bare.cam_from_world = record.cam_from_world;
  bare.map_revision = record.map_revision;
  bare.pose_information = record.pose_information;
  bare.landmark_count = record.landmark_count;
  return bare;
}

bool SeesLittle(const std::vector<FrameRecord>& records, size_t i, double min_share) {
  const FrameRecord& record = records[i];
  const auto is_doubtful_beside = [&](const FrameRecord& neighbour) {
    return !neighbour.located() || record.landmark_count < min_share * neighbour.landmark_count;
  };
  return !record.located() || (i > 0 && is_doubtful_beside(records[i - 1])) ||
         (i + 1 < records.size() && is_doubtful_beside(records[i + 1]));
}

void Thin(int max_seen, FrameRecord* record) {
  const size_t count = record->seen.size(), kept = static_cast<size_t>(max_seen);
  if (count <= kept) return;
  std::vector<FrameRecord::Seen> some;
  some.reserve(kept);
  for (size_t i = 0; i < kept; ++i) some.push_back(record->seen[i * count / kept]);
  record->seen = std::move(some);
}

}  // namespace deepuav
