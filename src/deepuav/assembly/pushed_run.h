#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "deepuav/assembly/finished_run.h"
#include "deepuav/assembly/loaded_maps.h"
#include "deepuav/assembly/pushed_images.h"
#include "deepuav/assembly/run_options.h"

namespace deepuav {

/// How a run over pushed images is set up; what the options say comes beside it.
struct PushRequest {
  Camera camera;  ///< Of the images as they are pushed.
  std::string schedule = "threaded";
  std::string map;     ///< A map.deepuav to go on with, or empty.
  int queue_size = 4;  ///< Images that may wait; live: 1 does.
  /// Where the sensors are, and their noise; without samples.
  std::optional<ImuStream> imu;
  GnssStream gnss;
  BarometerStream barometer;
};

/// SLAM over images that are pushed. One run an instance, on threads of its own. Thread-safe:
/// images may come from one thread and samples from others.
class PushedRun {
 public:
  /// `observer` (may be null) must outlive it. Throws WrongUse for a request that cannot be, Error
  /// for networks and maps that are missing, damaged or do not fit.
  PushedRun(const PushRequest& request, std::unique_ptr<RunSettings> settings,
            RunObserver* observer);
  /// Gives up what was not finished.
  ~PushedRun();

  /// Of the size of the camera given; not changed from then on. Waits for room in the queue, unless
  /// live. Throws Error for another size, a time that does not grow, and once the run has ended.
  void Feed(const GreyImage& image, Timestamp time);
  void FeedImu(const ImuSample& sample);
  void FeedFix(const GnssFix& fix);
  void FeedBarometer(const BarometerSample& sample);

  /// Waits for the run to end after the last image. Once.
  FinishedRun Finish();

 private:
  SensorStreams TakeSensors();
  void Work(Slam* slam);
  void ThrowEnded() const;

  const PushRequest request_;
  const std::unique_ptr<RunSettings> settings_;
  const Schedule schedule_;
  std::optional<LoadedAtlas> loaded_;
  const Camera camera_;  ///< Of the images as they are worked on.
  Eyes eyes_;
  PushedImages images_;
  std::mutex mutex_;  ///< Of what follows, while the run goes on.
  GnssStream gnss_;
  BarometerStream barometer_;
  bool is_finished_ = false;
  std::optional<Slam> slam_;
  FinishedRun run_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> has_ended_{false};  ///< Then `run_` is not written any more.
  std::thread thread_;
};

}  // namespace deepuav
