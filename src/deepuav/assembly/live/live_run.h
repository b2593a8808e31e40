#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "deepuav/assembly/live/latency_meter.h"
#include "deepuav/assembly/live/live_lens.h"
#include "deepuav/assembly/live/pushed_run.h"
#include "deepuav/capture/dataset_source.h"
#include "deepuav/capture/live_feed.h"
#include "deepuav/capture/stream_source.h"

namespace deepuav {

/// What a live run looks at, and how.
struct LiveRequest {
  std::string source;          ///< /dev/video0, an address, a video file or a dataset.
  std::string camera;          ///< A camera.yaml, or empty: the dataset's own, or else a guess.
  std::string map;             ///< A map.deepuav to go on with, or empty.
  std::string clock = "auto";  ///< arrival, stream, or auto: stream of files, else arrival.
  DatasetPace pace;            ///< Of a file or dataset.
  StreamOptions stream;        ///< Of a camera or an address.
  LiveFeedOptions feed;        ///< `clock.clock` is set by `clock`.
  LiveLensOptions lens;        ///< Where there is no calibration.
};

/// Who is told of a live run while it goes on, and may end it.
struct LiveHooks {
  RunObserver* observer = nullptr;
  /// An image goes to the run, of which OnFrame then tells with this time.
  std::function<void(Timestamp time, const Stopwatch& since_arrival)> arrived;
  std::function<bool()> stop;                        ///< Asked in any thread.
  std::function<void(const std::string& line)> say;  ///< What happens to link and picture.
  std::filesystem::path out;                         ///< Saved into...
  double save_every_s = 0;                           ///< ...so often; 0: at the end only.
};

/// How a live run does.
struct LiveStatus {
  bool is_fed = false;  ///< Whether images go, or went, to the run.
  LiveCounts counts;
  int pushed = 0, skipped = 0;      ///< Images for the run, and of these overtaken by newer ones.
  LatencyMeter::Latencies latency;  ///< Of the latest seconds.
};

/// SLAM over images that come when they are taken. One run an instance.
class LiveRun {
 public:
  /// Opens the source and looks at its first image. Throws WrongUse for a request that cannot be,
  /// Error for what cannot be read.
  LiveRun(LiveRequest request, std::unique_ptr<RunSettings> settings);
  ~LiveRun();

  /// Samples of this sensor will come, which is fixed to the camera and has a clock of its own.
  /// Only before Run.
  void ExpectImu(ImuStream sensor);
  /// The same of a receiver.
  void ExpectGnss(GnssStream receiver);
  /// A sample on the images' times, later than the one before; left aside where no run is under
  /// way. Thread-safe.
  void FeedImu(const ImuSample& sample);
  /// The same of a fix, which is somewhere on Earth.
  void FeedFix(const GnssFix& fix);

  /// Looks for the lens where it is no more than guessed; nothing is tracked meanwhile. Before Run.
  /// Throws Error where the source cannot be opened.
  void LearnLens(const LiveHooks& hooks);

  /// Until the source ends or `stop` says true; waits until what is being saved is there, and
  /// leaves the last saving to the caller. What ends it early is told in the result. Throws Error
  /// for networks and maps that are missing, damaged or do not fit.
  FinishedRun Run(const LiveHooks& hooks);

  /// Of the images as they are worked on.
  Camera working_camera() const;
  std::string SourceName() const { return source_->Name(); }
  /// body_from_cam where the source is a dataset that says it.
  std::optional<SE3> BodyFromCam() const {
    return dataset_ ? dataset_->BodyFromCam() : std::nullopt;
  }
  /// Of a dataset that has one, on the times that its images have when it is seen once.
  std::optional<ImuStream> Imu() const;
  std::optional<GnssStream> Gnss() const;
  /// Thread-safe.
  LiveStatus status() const;

 private:
  void OpenSource();
  void FindStreamCamera();
  LiveFacts Facts() const;
  /// What a run over pushed images does not know of where they come from.
  void Complete(FinishedRun* run) const;
  std::optional<SampleCalibration> FindLens(const LiveHooks& hooks);
  void Say(const LiveHooks& hooks, const std::string& line) const;
  void FeedAll(const LiveHooks& hooks, PushedRun* run);

  LiveRequest request_;
  std::unique_ptr<RunSettings> settings_;
  std::unique_ptr<Dataset> dataset_;
  std::unique_ptr<LiveSource> source_;
  PushRequest push_;
  std::optional<double> guessed_focal_px_;  ///< Where the lens was found since.
  LatencyMeter latency_;
  mutable std::mutex mutex_;  ///< Of the pointers, while the run goes on.
  const LiveFeed* feed_ = nullptr;
  PushedRun* run_ = nullptr;
  LiveStatus last_;  ///< Once it is over.
};

}  // namespace deepuav
