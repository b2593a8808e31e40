#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "deepuav/base/ids.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/geometry/sim3.h"
#include "deepuav/map/gauge.h"
#include "deepuav/map/map.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

/// A keyframe that went into a map, as it was then.
struct KeyframeEvent {
  KeyframeId id;
  FrameId frame;
  Timestamp time;
  MapId map;
  SE3 cam_from_world;
  std::vector<Eigen::Vector3d> new_landmarks_world;
};

enum class MapChange {
  kStarted,
  kLoopClosed,  ///< Everything around may have moved and grown.
  kMerged,      ///< `map` became part of `into`.
  kAdjusted,    ///< As a whole, after a loop or a merger.
};

struct MapEvent {
  MapChange change = MapChange::kStarted;
  MapId map;
  MapId into;               ///< Of kMerged; else `map`.
  Sim3 into_from_map = {};  ///< Of kMerged: from the world of `map` to that of `into`.
  int64_t revision = 0;     ///< Of `into` from then on (Map::revision).
};

/// A map of photographs that are made one all at once, while it grows: in a world of its own, which
/// changes with it.
struct MapSketch {
  MapId map;
  std::vector<SE3> cam_from_world;
  std::vector<Eigen::Vector3d> points_world;
};

/// The keyframe as it is now, with the landmarks that were made of it.
KeyframeEvent EventOf(const Keyframe& keyframe, const Map& map);

/// Is told of a run while it goes on. Calls come from the run's threads, one at a time for each
/// function but several functions at once; what they do holds the run up, and must not throw.
/// Nothing that is told can change the run.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  /// A frame's state as it was when its turn came, in the frames' order. The record's
  /// cam_from_world is in the world of its map as it was then. `frame` shares features and image
  /// with the run, which are not changed any more.
  virtual void OnFrame(const FrameRecord& record, const Frame& frame) = 0;
  virtual void OnKeyframe(KeyframeEvent event) = 0;
  virtual void OnMap(const MapEvent& event) = 0;
  /// What the world of a map means, from this revision of it on (Map::revision): of maps that were
  /// loaded, before the first frame, and of those that another becomes part of.
  virtual void OnGauge(MapId /*map*/, int64_t /*revision*/, const Gauge& /*gauge*/) {}
  /// Of photographs now and then, in place of keyframes; these follow once the maps are done.
  virtual void OnSketch(const MapSketch& /*sketch*/) {}
  /// After every keyframe and change, with the map as it is now: to be read during the call only.
  virtual void OnMapState(const Map& /*map*/) {}
  /// All that was told is void: the run begins anew at the first image, knowing its camera better.
  virtual void OnRestart() {}
  /// A stage ended that took so long.
  virtual void OnStage(const std::string& /*stage*/, double /*seconds*/) {}
};

}  // namespace deepuav
