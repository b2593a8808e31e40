#include "deepuav/system/frame_record.h"

namespace deepuav {

FrameRecord MakeRecord(const Frame& frame, const TrackingResult& result) {
  FrameRecord record;
  record.keypoint_count = frame.features->size();
  record.id = frame.id;
  record.time = frame.time;
  record.state = result.state;
  record.reason = result.reason;
  if (!result.pose) {
    record.features = frame.features;
    return record;
  }
  record.tracked_online = true;
  record.map = result.pose->map;
  record.pose = result.pose->anchored;
  record.seen.reserve(result.pose->matches.size());
  for (const LandmarkMatch& match : result.pose->matches) {
    const Keypoint& keypoint = frame.features->keypoints[static_cast<size_t>(match.keypoint)];
    record.seen.push_back({match.landmark, keypoint.px, keypoint.sigma_px});
  }
  return record;
}

}  // namespace deepuav
