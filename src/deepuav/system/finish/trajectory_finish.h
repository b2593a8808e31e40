#pragma once

#include <functional>
#include <map>
#include <vector>

#include "deepuav/localisation/frame_locator.h"
#include "deepuav/map/atlas.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

/// The end of an offline run: gives every record its final pose in its map.
class TrajectoryFinish {
 public:
  /// All must outlive it; the map is not changed any more. Keyframes from `first_new_keyframe` on
  /// are of this run.
  TrajectoryFinish(const Camera& camera, const LocatorOptions& options,
                   const LocalMapOptions& local_map_options, int max_gap_frames, const Atlas& atlas,
                   KeyframeId first_new_keyframe, FrameLocator* locator);

  /// Takes over the poses of keyframes, optimises every other located frame once more against the
  /// map, and locates those that still have their features, which are doubtful, again from their
  /// neighbours, until `stop`, asked before each, says true.
  void LocateDoubtful(std::vector<FrameRecord>* records,
                      const std::function<bool()>& stop = nullptr) const;

  /// The same poses by the final map, then those of frames without one, outwards from their located
  /// neighbours, first backwards, then forwards. Located frames lose their features.
  void Finish(std::vector<FrameRecord>* records, const std::function<bool()>& stop = nullptr) const;

  /// The last step alone: frames without a pose from their located neighbours.
  void LocateLost(std::vector<FrameRecord>* records,
                  const std::function<bool()>& stop = nullptr) const;

  /// Of a located frame, by the landmarks that it saw and the map as it is.
  SE3 RefinedPose(const FrameRecord& record) const;

 private:
  /// By the landmarks that a frame saw; without inliers where too few agree.
  MotionOnlyResult Refined(const FrameRecord& record) const;
  /// Takes over that pose, and how well it is known.
  void Refine(FrameRecord* record) const;
  /// The keyframes of this run that see enough to be trusted.
  std::map<FrameId, const Keyframe*> TrustedKeyframes() const;
  /// The poses of frames in the map as it is.
  void RefineAll(std::vector<FrameRecord>* records, const std::function<bool()>& stop) const;
  /// Frame i anew from its neighbours in the same map, or from one where the other is not in it.
  bool LocateBetween(const std::vector<FrameRecord>& records, size_t i, FrameRecord* record) const;
  void LocateTowards(int step, std::vector<FrameRecord>* records,
                     const std::function<bool()>& stop) const;
  bool Locate(const FrameRecord& neighbour, const FrameRecord* before, FrameRecord* record) const;

  const Camera camera_;
  const LocatorOptions options_;
  const LocalMapOptions local_map_options_;
  const int max_gap_frames_;
  const Atlas& atlas_;
  const KeyframeId first_new_keyframe_;
  FrameLocator* locator_;
};

}  // namespace deepuav
