#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "deepuav/system/sensors/moving_path.h"
#include "deepuav/system/sensors/running_place.h"
#include "deepuav/system/watching/run_observer.h"

namespace deepuav {

/// Finds, beside a run and without changing it, where on Earth position fixes put the map that the
/// camera is in. Works on a thread of its own. Without fixes what was told stays, and moves with
/// the map.
class PlaceWatch : public RunObserver {
 public:
  /// Told in the watch's thread: from this revision of the map on.
  using Tell = std::function<void(MapId map, int64_t revision, const PlacedWorld& world)>;

  /// `gnss`: the receiver, with all its fixes or such as are there already.
  PlaceWatch(GnssStream gnss, const SensorUseOptions& options, Tell tell);
  ~PlaceWatch() override;
  PlaceWatch(const PlaceWatch&) = delete;
  PlaceWatch& operator=(const PlaceWatch&) = delete;

  /// A fix that comes while the run goes on; one whose time does not grow is left aside.
  /// Thread-safe, as what follows.
  void AddFix(const GnssFix& fix);
  /// About which places are told from now on, in place of the first fix. One far from there, or
  /// hardly another than before, is left aside.
  void UseOrigin(const GeoPoint& origin);
  /// What an inertial sensor says of a map, from this revision of it on until the next.
  void UseMetric(MapId map, int64_t revision, const MetricWorld& world);

  void OnFrame(const FrameRecord& record, const Frame& frame) override;
  void OnKeyframe(KeyframeEvent /*event*/) override {}
  void OnMap(const MapEvent& /*event*/) override {}
  /// Of maps that have a place nothing is to be found.
  void OnGauge(MapId map, int64_t revision, const Gauge& gauge) override;
  void OnMapState(const Map& map) override;

 private:
  struct World {
    MapId map;
    int64_t revision = 0;
    bool operator==(const World&) const = default;
  };
  /// What is known of the metres of a map, in this revision of it or, where it `lasts`, in those
  /// after it, too.
  struct KnownMetric {
    World world;
    bool lasts = false;
    MetricWorld metric;
  };
  struct Job {
    World world;
    Timestamp time;
    RunningPlace::Evidence evidence;
  };

  void Work();
  std::unique_ptr<Job> NextJob();
  void Do(const Job& job);
  void TellRefusal(const Job& job, const RunningPlace& running);
  bool IsDue(const World& world, Timestamp time) const;
  bool HasFixNear(Timestamp time) const;
  void ForgetBefore(Timestamp time);
  void ForgetOld();
  GeoPoint Origin();
  std::optional<MetricWorld> MetricOf(const World& world) const;
  void Add(GnssFix fix);
  void PrepareJob(const FrameRecord& record);

  const GeoreferenceOptions options_;
  const double clock_offset_s_;
  /// Without a fix so near in time, poses tell nothing.
  const double near_s_;
  const RunningPlace nothing_told_;
  const Tell tell_;
  std::mutex mutex_;  ///< Of what follows, up to the thread's own.
  std::condition_variable changed_;
  std::unique_ptr<Job> job_;  ///< The newest that is to be done.
  bool is_over_ = false;
  std::vector<GnssFix> fixes_;  ///< On the camera's clock.
  std::optional<GeoPoint> first_fix_, origin_;
  bool warned_of_origin_ = false;
  std::optional<Timestamp> shown_until_;  ///< The latest image, located or not.
  MovingPath path_;
  std::set<MapId> known_;  ///< Maps that have a place.
  std::vector<KnownMetric> metrics_;
  std::optional<std::pair<World, Timestamp>> tried_;  ///< When it was looked for last...
  double wait_s_;                                     ///< ...and for how long it waits then.
  std::map<MapId, RunningPlace> running_;             ///< Of the thread alone.
  std::optional<Timestamp> refused_at_;               ///< The same.
  std::thread thread_;
};

}  // namespace deepuav
