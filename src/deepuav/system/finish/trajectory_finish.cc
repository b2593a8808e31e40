#include "deepuav/system/finish/trajectory_finish.h"

#include <algorithm>

#include "deepuav/system/finish/neighbour_location.h"
#include "deepuav/system/frames/frame_path.h"

namespace deepuav {

TrajectoryFinish::TrajectoryFinish(const Camera& camera, const LocatorOptions& options,
                                   const LocalMapOptions& local_map_options, int max_gap_frames,
                                   const Atlas& atlas, KeyframeId first_new_keyframe,
                                   FrameLocator* locator)
    : camera_(camera),
      options_(options),
      local_map_options_(local_map_options),
      max_gap_frames_(max_gap_frames),
      atlas_(atlas),
      first_new_keyframe_(first_new_keyframe),
      locator_(locator) {}

void TrajectoryFinish::Finish(std::vector<FrameRecord>* records,
                              const std::function<bool()>& stop) const {
  RefineAll(records, stop);
  for (FrameRecord& record : *records) {
    if (record.located()) record.features.reset();
  }
  LocateLost(records, stop);
}

void TrajectoryFinish::RefineAll(std::vector<FrameRecord>* records,
                                 const std::function<bool()>& stop) const {
  const std::map<FrameId, const Keyframe*> keyframes = TrustedKeyframes();
  for (FrameRecord& record : *records) {
    if (stop && stop()) return;
    if (!record.located()) continue;
    if (const auto known = keyframes.find(record.id); known != keyframes.end()) {
      const Keyframe& keyframe = *known->second;
      record.pose = {keyframe.id, SE3(), keyframe.scale};
      record.cam_from_world = keyframe.cam_from_world;
    } else {
      Refine(&record);
    }
  }
}

void TrajectoryFinish::LocateLost(std::vector<FrameRecord>* records,
                                  const std::function<bool()>& stop) const {
  LocateTowards(-1, records, stop);
  LocateTowards(+1, records, stop);
}

std::map<FrameId, const Keyframe*> TrajectoryFinish::TrustedKeyframes() const {
  std::map<FrameId, const Keyframe*> keyframes;
  for (MapId map : atlas_.Remaining()) {
    atlas_.At(map).keyframes().ForEach([&](const Keyframe& keyframe) {
      if (keyframe.id >= first_new_keyframe_ && keyframe.LandmarkCount() >= options_.min_inliers)
        keyframes.emplace(keyframe.frame.id, &keyframe);
    });
  }
  return keyframes;
}

MotionOnlyResult TrajectoryFinish::Refined(const FrameRecord& record) const {
  const Map& map = atlas_.At(record.map);
  const SE3 initial = map.PoseOf(record.pose);
  const std::vector<PoseObservation> observations = ObservationsOf(map, record, initial);
  MotionOnlyResult refined =
      OptimisePose(camera_.pinhole, observations, initial, options_.motion_only);
  if (refined.inlier_count >= options_.min_inliers) return refined;
  MotionOnlyResult unchanged;
  unchanged.cam_from_world = initial;
  return unchanged;
}

SE3 TrajectoryFinish::RefinedPose(const FrameRecord& record) const {
  return Refined(record).cam_from_world;
}

void TrajectoryFinish::Refine(FrameRecord* record) const {
  const MotionOnlyResult refined = Refined(*record);
  record->cam_from_world = refined.cam_from_world;
  if (refined.inlier_count == 0) return;
  const Map& map = atlas_.At(record->map);
  const KeyframeId anchor = map.Remaining(record->pose.keyframe);
  const Keyframe& keyframe = map.At(anchor);
  record->pose = {anchor, refined.cam_from_world * keyframe.cam_from_world.Inverse(),
                  keyframe.scale};
  record->pose_information = refined.information;
}

void TrajectoryFinish::LocateDoubtful(std::vector<FrameRecord>* records,
                                      const std::function<bool()>& stop) const {
  RefineAll(records, stop);
  const std::map<FrameId, const Keyframe*> keyframes = TrustedKeyframes();
  for (size_t i = 0; i < records->size(); ++i) {
    FrameRecord& record = (*records)[i];
    const bool is_doubtful = record.located() && record.features && !record.is_sure;
    if (!is_doubtful || keyframes.contains(record.id)) continue;
    if (stop && stop()) return;
    FrameRecord again = record;
    if (!LocateBetween(*records, i, &again) || again.landmark_count <= record.landmark_count)
      continue;
    again.features = std::move(record.features);
    record = std::move(again);
  }
}

bool TrajectoryFinish::LocateBetween(const std::vector<FrameRecord>& records, size_t i,
                                     FrameRecord* record) const {
  const auto in_map = [&](ptrdiff_t k) -> const FrameRecord* {
    if (k < 0 || k >= std::ssize(records)) return nullptr;
    const FrameRecord& other = records[static_cast<size_t>(k)];
    return other.map == record->map ? &other : nullptr;
  };
  const auto at = static_cast<ptrdiff_t>(i);
  const FrameRecord* previous = in_map(at - 1);
  const FrameRecord* next = in_map(at + 1);
  if (previous) return Locate(*previous, next ? next : in_map(at - 2), record);
  return next && Locate(*next, in_map(at + 2), record);
}

void TrajectoryFinish::LocateTowards(int step, std::vector<FrameRecord>* records,
                                     const std::function<bool()>& stop) const {
  const int count = static_cast<int>(records->size());
  const FrameRecord* neighbour = nullptr;
  const FrameRecord* before = nullptr;  // the one located before the neighbour
  int misses = 0;
  for (int i = step > 0 ? 0 : count - 1; i >= 0 && i < count; i += step) {
    FrameRecord& record = (*records)[static_cast<size_t>(i)];
    if (!record.located()) {
      if (stop && stop()) return;
      const bool reachable = neighbour && record.features && misses < max_gap_frames_;
      if (!reachable || !Locate(*neighbour, misses == 0 ? before : nullptr, &record)) {
        ++misses;
        continue;
      }
    }
    before = neighbour && neighbour->map == record.map ? neighbour : nullptr;
    neighbour = &record;
    misses = 0;
  }
}

bool TrajectoryFinish::Locate(const FrameRecord& neighbour, const FrameRecord* before,
                              FrameRecord* record) const {
  const Map& map = atlas_.At(neighbour.map);
  const LocationPrior prior = PriorBeside(map, neighbour, before, record->time);
  const auto local_map = MakeLocalMap(map, prior.reference, local_map_options_);
  const Frame frame = FrameToLocate(*record);
  const auto located = locator_->Locate(frame, *local_map, prior, &record->reason);
  if (!located) return false;
  const bool tracked_online = record->tracked_online;
  *record = LocatedRecord(frame, PoseIn(*local_map, *located));
  record->features.reset();
  record->tracked_online = tracked_online;
  return true;
}

}  // namespace deepuav
