#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "deepuav/api/types.h"

namespace deepuav::api {

/// A pose in metres, as far as is known while the run goes on.
struct MetricPose {
  GaugeKind gauge = GaugeKind::kMetric;  ///< Never free.
  /// Metres, z up; where the map is georeferenced, east, north and up of the origin.
  Pose metric_from_camera;
  double scale_sigma = 0;  ///< Standard deviation of the scale, as a share of it.
  double origin_latitude_deg = 0, origin_longitude_deg = 0, origin_altitude_m = 0;
};

/// An image's pose when its turn came, in the world of its map as it was then: later corrections
/// move both.
struct FrameEvent {
  Frame frame;
  /// As soon as the samples and fixes that are fed to a Slam tell metres or a place on Earth, or
  /// where its map had them before; both may be told anew, and better.
  std::optional<MetricPose> metric = {};
};

/// A keyframe that went into a map, and the points that were made with it.
struct KeyframeEvent {
  Keyframe keyframe;
  std::int64_t frame = 0;
  std::vector<Vector3> new_landmarks_world;
};

enum class MapChange {
  kStarted,
  kLoopClosed,  ///< Everything around may have moved and grown.
  kMerged,      ///< `map` became part of `into`.
  kAdjusted,    ///< As a whole.
};

struct MapEvent {
  MapChange change = MapChange::kStarted;
  int map = -1;   ///< Numbered in the order in which maps are started.
  int into = -1;  ///< Of kMerged; else `map`.
};

/// Watches a run. Calls come one after the other, in the order of what happened, on a thread of the
/// library's own. Events wait in a queue of limited size; when an observer is too slow for it, the
/// oldest frames and keyframes are dropped and counted, and changes of maps only where a thousand
/// of them wait. Watching never changes or holds up the run; what an observer throws is ignored,
/// and it is not called any more.
class DEEPUAV_API Observer {
 public:
  Observer();
  virtual ~Observer();
  virtual void OnFrame(const FrameEvent& event);
  virtual void OnKeyframe(const KeyframeEvent& event);
  virtual void OnMap(const MapEvent& event);
  /// All that was told is void: the run begins anew at the first image, knowing its camera better.
  virtual void OnRestart();
  /// `dropped` events before the next one were not delivered.
  virtual void OnDropped(std::int64_t dropped);
};

}  // namespace deepuav::api
