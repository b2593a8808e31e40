#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "deepuav/assembly/live/pushed_images.h"
#include "deepuav/assembly/maps/loaded_maps.h"
#include "deepuav/assembly/networks/eyes.h"
#include "deepuav/assembly/output/finished_run.h"
#include "deepuav/assembly/settings/run_options.h"

namespace deepuav {

/// How a run over pushed images is set up; what the options say comes beside it.
struct PushRequest {
  Camera camera;                      ///< Of the images as they are pushed.
  std::string schedule = "threaded";  ///< Live, memory does not grow with time: live_limits.h.
  std::string map;                    ///< A map.deepuav to go on with, or empty.
  int queue_size = 4;                 ///< Images that may wait; live: 1 does.
  /// Where the sensors are, and their noise; without samples.
  std::optional<ImuStream> imu;
  /// Whether its samples' times are those of the images to the millisecond: else they do not tell
  /// what the camera turned by while it read an image, and none waits for that.
  bool imu_is_synchronised = true;
  std::optional<double> max_imu_wait_s;  ///< For which an image waits for samples at most.
  GnssStream gnss;
  BarometerStream barometer;
  std::string kind = "pushed images", source;  ///< For the summary: what they are, and of what.
  CalibrationSource calibration;               ///< Of `camera`.
  std::optional<RefinedLens> lens = {};        ///< Where it was found from images.
};

/// Who is told of a run over pushed images.
struct PushHooks {
  RunObserver* observer = nullptr;
  /// Asked in any thread: whether to end, as Stop().
  std::function<bool()> stop;
  /// Asked after each frame: whether to save what there is of the run...
  std::function<bool()> save_due;
  /// ...which this is then given, in one of the run's threads.
  std::function<void(FinishedRun)> save;
};

/// SLAM over images that are pushed. One run an instance, on threads of its own. Thread-safe:
/// images may come from one thread and samples from others.
class PushedRun {
 public:
  /// What `hooks` holds must outlive it. Throws WrongUse for a request that cannot be, Error
  /// for networks and maps that are missing, damaged or do not fit.
  PushedRun(const PushRequest& request, std::unique_ptr<RunSettings> settings,
            const PushHooks& hooks);
  /// Gives up what was not finished.
  ~PushedRun();

  /// Of the size of the camera given; not changed from then on. Waits for room in the queue, unless
  /// live. Throws Error for another size, a time that does not grow, and once the run has ended.
  void Feed(const GreyImage& image, Timestamp time);
  void FeedImu(const ImuSample& sample);
  void FeedFix(const GnssFix& fix);
  void FeedBarometer(const BarometerSample& sample);

  /// No more images are looked at, and the end of the run takes limited time.
  void Stop();
  /// Images pushed, and of these overtaken by newer ones.
  int pushed() const { return images_.pushed(); }
  int skipped() const { return images_.skipped(); }
  /// Of the images as they are worked on.
  const Camera& working_camera() const { return camera_; }
  /// Whether it ended by itself: by a failure, which Finish tells.
  bool has_ended() const { return has_ended_; }

  /// Waits for the run to end after the last image. Once.
  FinishedRun Finish();

 private:
  SensorStreams TakeSensors();
  void Work(Slam* slam);
  void ThrowEnded() const;
  FinishedRun Meanwhile(SlamResult result, Atlas atlas) const;

  const PushRequest request_;
  const std::function<bool()> asked_to_stop_;
  const Schedule schedule_;
  const std::unique_ptr<RunSettings> settings_;
  const size_t kept_samples_;  ///< Of each sensor; 0: all.
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
  RunFacts facts_before_;
  Stopwatch running_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> has_ended_{false};  ///< Then `run_` is not written any more.
  std::thread thread_;
};

}  // namespace deepuav
