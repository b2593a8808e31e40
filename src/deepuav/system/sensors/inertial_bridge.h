#pragma once

#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "deepuav/inertial/alignment/inertial_alignment.h"
#include "deepuav/inertial/paths/path_link.h"
#include "deepuav/map/atlas.h"
#include "deepuav/mapping/mapper.h"
#include "deepuav/system/frames/frame_path.h"

namespace deepuav {

/// A frame's pose as the samples alone have it.
struct ReckonedFrame {
  size_t record = 0;  ///< Its place among the records.
  MapId map;
  AnchoredPose pose;
};

/// Where the camera saw nothing that it knew for a while, an inertial sensor tells how it moved
/// meanwhile: which makes one map of what lies before and after, and gives the frames between their
/// poses.
class InertialBridge {
 public:
  /// All must outlive it. `attempts`: what the sensor told of each map; those maps are in metres.
  InertialBridge(const ImuStream& imu, const InertialOptions& options, PoseOfFrame pose_of_frame,
                 const std::map<MapId, InertialAttempt>& attempts, Mapper* mapper, Atlas* atlas);

  /// Joins maps that follow one another in time, as long as one of both is in metres and the motion
  /// between fits. Returns how many became part of another. `records` are of all frames.
  int JoinMaps(const std::vector<FrameRecord>& records);

  /// The frames without a pose between two that have one in the same map.
  std::vector<ReckonedFrame> Reckon(const std::vector<FrameRecord>& records) const;

 private:
  /// Two records with poses, and none with one between them.
  struct Gap {
    size_t before, after;
  };

  std::vector<Gap> GapsOf(const std::vector<FrameRecord>& records) const;
  /// The map's motion at its pose nearest to a moment; nothing where none is near.
  std::optional<MotionState> MotionNear(MapId map, Timestamp time) const;
  bool Join(const std::vector<FrameRecord>& records, const Gap& gap);
  /// Moves a map into the world of another, its motions too.
  void MoveTo(MapId known, MapId other, const Sim3& known_from_other);
  /// Gives a map that moved into the world of `known` motions: its poses, and velocities by the
  /// samples.
  void CarryAlong(const MotionState& known, MapId other, const std::vector<FrameRecord>& records);
  /// The motions of two maps that were joined become those of one.
  void TakeMotions(MapId before, MapId after);
  void ReckonBetween(const std::vector<FrameRecord>& records, const Gap& gap,
                     std::vector<ReckonedFrame>* frames) const;

  const SE3 cam_from_imu_;
  const InertialOptions options_;
  const PoseOfFrame pose_of_frame_;
  Mapper* mapper_;
  Atlas* atlas_;
  const ImuIntegrator integrator_;
  DeadReckoning reckoning_;
  std::map<MapId, std::vector<MotionState>> motions_;  ///< Of maps in metres, by time.
  std::set<std::pair<MapId, MapId>> refused_;
};

/// Gives the frames that still have none these poses.
void TakeReckoned(const Atlas& atlas, const std::vector<ReckonedFrame>& frames,
                  std::vector<FrameRecord>* records);

}  // namespace deepuav
