#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/map/frame.h"
#include "deepuav/tracking/tracker.h"

namespace deepuav {

/// What is remembered of every frame until the end of the run.
struct FrameRecord {
  struct Seen {
    LandmarkId landmark;
    PixelMeasurement measured;
  };
  FrameId id;
  Timestamp time;
  TrackingState state = TrackingState::kInitialising;
  std::string reason;  ///< Why there is no pose.
  int keypoint_count = 0;

  bool tracked_online = false;  ///< Had its pose when its turn came, not only at the end.
  bool reckoned = false;        ///< Its pose is what an inertial sensor alone tells.
  bool inferred = false;        ///< Its pose is the most probable one between those about it.
  MapId map;                    ///< Invalid where there is no pose.
  AnchoredPose pose;
  SE3 cam_from_world;        ///< As tracked, once the trajectory is finished as
                             ///< in the final map.
  int64_t map_revision = 0;  ///< Map::revision when it was tracked.
  /// Of cam_from_world's twist [translation; rotation] as tracked, at the end as refined,
  /// left-multiplied, in the map's units then: what the image's pixels tell, in a map that is taken
  /// as it is. 0: unknown.
  Matrix6d pose_information = Matrix6d::Zero();
  int landmark_count = 0;                    ///< That spoke for the pose.
  std::vector<Seen> seen;                    ///< These, or once the frame is old some of them...
  ReadoutMotion seen_motion;                 ///< ...and what their pixels are corrected for.
  std::shared_ptr<const Features> features;  ///< Kept where the pose is missing or doubtful, or
                                             ///< the map may be a brief one...
  bool is_sure = false;                      ///< ...though the pose is not...
  ReadoutMotion motion;                      ///< ...with what they are corrected for...
  bool turn_is_measured = false;             ///< ...as Frame's.

  bool located() const { return map.valid(); }
};

FrameRecord MakeRecord(const Frame& frame, const TrackingResult& result);

/// Gives what was measured in the frame another place in the undistorted camera.
void MovePixels(const PixelMove& move, FrameRecord* record);

/// The record without landmarks seen and features.
FrameRecord WithoutWhatItSaw(const FrameRecord& record);

/// Whether the pose of frame i may be wrong: it sees few landmarks beside a neighbour, less than
/// this share of its, or the neighbour was lost; or it has no pose.
bool SeesLittle(const std::vector<FrameRecord>& records, size_t i, double min_share);

/// Keeps `max_seen` of what the frame saw, spread evenly.
void Thin(int max_seen, FrameRecord* record);

}  // namespace deepuav
