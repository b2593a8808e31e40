#pragma once

#include <functional>
#include <optional>
#include <set>
#include <thread>

#include "deepuav/base/queue.h"
#include "deepuav/inertial/alignment/running_alignment.h"
#include "deepuav/system/watching/run_observer.h"

namespace deepuav {

/// Finds, beside a run and without changing it, which metres and level an inertial sensor gives the
/// map that the camera is in. Works on a thread of its own; poses that come while it is busy and
/// its queue is full are left out.
class MetricWatch : public RunObserver {
 public:
  /// Told in the watch's thread: from this revision of the map on.
  using Tell = std::function<void(MapId map, int64_t revision, const MetricWorld& world)>;

  /// `imu`: the sensor, with all its samples or such as are there already.
  MetricWatch(ImuStream imu, const InertialOptions& options, Tell tell);
  ~MetricWatch() override;
  MetricWatch(const MetricWatch&) = delete;
  MetricWatch& operator=(const MetricWatch&) = delete;

  /// A sample that comes while the run goes on, in any thread; one whose time does not grow is left
  /// aside. Only those are kept that the path's latest part may need.
  void AddSample(const ImuSample& sample) { imu_.Add(sample); }

  void OnFrame(const FrameRecord& record, const Frame& frame) override;
  void OnKeyframe(KeyframeEvent /*event*/) override {}
  void OnMap(const MapEvent& /*event*/) override {}
  /// Of maps that have metres nothing is to be found.
  void OnGauge(MapId map, int64_t revision, const Gauge& gauge) override;

 private:
  struct SeenPose {
    TimedPose pose;
    MapId map;
    int64_t revision = 0;
  };

  void Work();
  void TellRefusal(const SeenPose& seen);

  ImuWindow imu_;
  const Tell tell_;
  BoundedQueue<SeenPose> poses_;
  std::mutex mutex_;
  std::set<MapId> known_;  ///< Maps that have metres.
  RunningAlignment running_;
  std::optional<Timestamp> refused_at_;  ///< When it was said last that there are no metres.
  std::thread thread_;
};

}  // namespace deepuav
