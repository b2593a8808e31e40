#include "deepuav/assembly/live/live_run.h"

#include "deepuav/assembly/maps/meanwhile_saver.h"
#include "deepuav/assembly/settings/wrong_use.h"
#include "deepuav/base/logging.h"
#include "deepuav/geometry/camera_scale.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/cameras/found_camera.h"

namespace deepuav {
namespace {

constexpr double kMostImuWait_s = 0.02;  // Poses are late by this where samples are later.

/// Passes everything on, and measures when poses come.
class MeasuringObserver : public RunObserver {
 public:
  MeasuringObserver(LatencyMeter* latency, RunObserver* next) : latency_(latency), next_(next) {}

  void OnFrame(const FrameRecord& record, const Frame& frame) override {
    latency_->Done(record.time);
    if (next_) next_->OnFrame(record, frame);
  }
  void OnKeyframe(KeyframeEvent event) override {
    if (next_) next_->OnKeyframe(std::move(event));
  }
  void OnMap(const MapEvent& event) override {
    if (next_) next_->OnMap(event);
  }
  void OnGauge(MapId map, int64_t revision, const Gauge& gauge) override {
    if (next_) next_->OnGauge(map, revision, gauge);
  }
  void OnMapState(const Map& map) override {
    if (next_) next_->OnMapState(map);
  }
  void OnStage(const std::string& stage, double seconds) override {
    if (next_) next_->OnStage(stage, seconds);
  }

 private:
  LatencyMeter* const latency_;
  RunObserver* const next_;
};

ImageClock ClockOf(const std::string& name, bool is_stream) {
  if (name == "arrival") return ImageClock::kArrival;
  if (name == "stream") return ImageClock::kStream;
  if (name != "auto") throw WrongUse("clock is '{}': expected auto, arrival or stream", name);
  return is_stream ? ImageClock::kArrival : ImageClock::kStream;
}

}  // namespace

LiveRun::LiveRun(LiveRequest request, std::unique_ptr<RunSettings> settings)
    : request_(std::move(request)), settings_(std::move(settings)) {
  const bool is_stream = IsStreamAddress(request_.source);
  request_.feed.clock.clock = ClockOf(request_.clock, is_stream);
  push_.schedule = "live";
  push_.map = request_.map;
  push_.kind = "live";
  OpenSource();
  push_.source = source_->Name();
  const double focal_sigma = push_.calibration.focal_sigma;
  if (focal_sigma > 0) MendLensAtEnd(focal_sigma, &settings_->options.system);
}

LiveRun::~LiveRun() = default;

void LiveRun::OpenSource() {
  if (IsStreamAddress(request_.source)) {
    if (request_.pace.loop || request_.pace.speed != 1)
      throw WrongUse("{}: --loop and --speed are of files and datasets",
                     WithoutSecrets(request_.source));
    FindStreamCamera();
    return;
  }
  DatasetOptions options = settings_->options.images;
  options.camera_file = request_.camera;
  dataset_ = OpenDataset(request_.source, options);
  push_.camera = dataset_->camera();
  push_.calibration = dataset_->Calibration();
  source_ = std::make_unique<DatasetSource>(dataset_.get(), request_.source, request_.pace);
}

void LiveRun::FindStreamCamera() {
  std::optional<CameraFile> file;
  if (!request_.camera.empty()) file = ReadCameraFile(request_.camera);
  StreamOptions options = request_.stream;
  const bool is_calibrated = file && file->has_intrinsics;
  if (is_calibrated) {
    options.width_px = file->camera.width;
    options.height_px = file->camera.height;
  }
  auto source = std::make_unique<StreamSource>(request_.source, options);
  source->Open();
  const std::optional<LiveImage> first = source->Next({});
  if (!first) throw Error("{}: gives no image: expected one", source->Name());
  const cv::Size size = first->image.size();
  if (is_calibrated) {
    push_.camera = CameraForSize(file->camera, size, source->Name(), request_.camera);
    if (file->refine) push_.calibration = CalibrationByHand();
  } else {
    const FoundCamera guess = GuessedCamera(size);
    push_.camera = guess.camera;
    push_.calibration = guess.source;
    Log().warn("{}: no calibration: the focal length is a guess, {:.0f} px: --camera gives one",
               source->Name(), guess.camera.pinhole.fx);
  }
  source_ = std::move(source);
}

Camera LiveRun::working_camera() const {
  const cv::Size size = WorkingSize({push_.camera.width, push_.camera.height},
                                    settings_->options.images.working_pixels);
  return ScaledCamera(push_.camera, size.width, size.height);
}

std::optional<ImuStream> LiveRun::Imu() const {
  if (!dataset_ || request_.feed.clock.clock != ImageClock::kStream) return std::nullopt;
  ImuStream imu = dataset_->ReadSensors().imu;
  if (imu.samples.empty()) return std::nullopt;
  return imu;
}

void LiveRun::ExpectImu(ImuStream sensor) {
  push_.imu = std::move(sensor);
  push_.imu_is_synchronised = false;
  push_.max_imu_wait_s = kMostImuWait_s;
}

void LiveRun::FeedImu(const ImuSample& sample) {
  const std::scoped_lock lock(mutex_);
  if (run_) run_->FeedImu(sample);
}

std::optional<GnssStream> LiveRun::Gnss() const {
  if (!dataset_ || request_.feed.clock.clock != ImageClock::kStream) return std::nullopt;
  GnssStream gnss = dataset_->ReadSensors().gnss;
  if (gnss.fixes.empty()) return std::nullopt;
  return gnss;
}

void LiveRun::ExpectGnss(GnssStream receiver) { push_.gnss = std::move(receiver); }

void LiveRun::FeedFix(const GnssFix& fix) {
  const std::scoped_lock lock(mutex_);
  if (run_) run_->FeedFix(fix);
}

LiveStatus LiveRun::status() const {
  constexpr size_t kLatest = 200;
  const std::scoped_lock lock(mutex_);
  LiveStatus status = last_;
  if (feed_) {
    status.is_fed = true;
    status.counts = feed_->counts();
  }
  if (run_) {
    status.pushed = run_->pushed();
    status.skipped = run_->skipped();
  }
  status.latency = latency_.Latest(kLatest);
  return status;
}

void LiveRun::Say(const LiveHooks& hooks, const std::string& line) const {
  Log().warn("{}: {}", source_->Name(), line);
  if (hooks.say) hooks.say(line);
}

std::optional<SampleCalibration> LiveRun::FindLens(const LiveHooks& hooks) {
  if (dataset_) return CalibrateFromSample(dataset_.get(), settings_->options, hooks.stop);
  const GuessedLens guess{push_.camera, push_.calibration.focal_sigma};
  return deepuav::LearnLens(source_.get(), guess, request_.feed, settings_->options, request_.lens,
                            {[&](const std::string& line) { Say(hooks, line); }, hooks.stop});
}

void LiveRun::LearnLens(const LiveHooks& hooks) {
  if (!push_.map.empty() || !IsGuess(push_.calibration.focal_sigma) || request_.lens.longest_s == 0)
    return;
  const std::string line =
      dataset_ ? "the lens is looked for in images from the middle"
               : "the lens is looked for: fly sideways and turn, until the images tell it";
  Log().info("{}: {}", source_->Name(), line);
  if (hooks.say) hooks.say(line);
  const std::optional<SampleCalibration> found = FindLens(hooks);
  request_.feed.was_open = true;
  if (!found) return;
  const double rate_hz = push_.camera.rate_hz;
  guessed_focal_px_ = push_.camera.pinhole.fx;
  push_.camera = ScaledCamera(found->camera, push_.camera.width, push_.camera.height);
  push_.camera.rate_hz = rate_hz;
  push_.calibration.focal_sigma = 0;
  push_.lens = found->lens;
  MendLensAtEnd(found->lens, &settings_->options.system);
}

LiveFacts LiveRun::Facts() const {
  const LiveCounts counts = status().counts;
  const LatencyMeter::Latencies latency = latency_.All();
  return {counts.arrived,   counts.frozen, counts.misfits, counts.reconnects,
          latency.median_s, latency.p95_s, latency.count,  counts.late};
}

void LiveRun::Complete(FinishedRun* run) const {
  run->facts.live = Facts();
  if (dataset_) run->facts.calibration.source = push_.calibration.text;
  if (guessed_focal_px_) run->facts.calibration.start_focal_px = *guessed_focal_px_;
}

void LiveRun::FeedAll(const LiveHooks& hooks, PushedRun* run) {
  const auto stop = [&] { return run->has_ended() || (hooks.stop && hooks.stop()); };
  LiveFeed feed(source_.get(), {push_.camera.width, push_.camera.height}, request_.feed,
                {[&](GreyImage image, Timestamp time, const Stopwatch& since_arrival) {
                   if (stop()) return;
                   latency_.Arrived(time, since_arrival);
                   if (hooks.arrived) hooks.arrived(time, since_arrival);
                   run->Feed(image, time);
                 },
                 [&](const std::string& line) { Say(hooks, line); }});
  {
    const std::scoped_lock lock(mutex_);
    feed_ = &feed;
  }
  const auto forget = [this] {
    const LiveStatus status = this->status();
    const std::scoped_lock lock(mutex_);
    last_ = status;
    feed_ = nullptr;
  };
  try {
    feed.Run(stop);
  } catch (...) {
    forget();
    throw;
  }
  forget();
}

FinishedRun LiveRun::Run(const LiveHooks& hooks) {
  MeasuringObserver observer(&latency_, hooks.observer);
  MeanwhileSaver saver(hooks.out, hooks.save_every_s);
  PushedRun run(push_, std::move(settings_),
                {&observer, hooks.stop, [&saver] { return saver.Due(); },
                 [&](FinishedRun meanwhile) {
                   Complete(&meanwhile);
                   saver.Save(std::move(meanwhile));
                 }});
  {
    const std::scoped_lock lock(mutex_);
    run_ = &run;
  }
  const auto forget = [this] {
    const LiveStatus status = this->status();
    const std::scoped_lock lock(mutex_);
    last_ = status;
    run_ = nullptr;
  };
  try {
    FeedAll(hooks, &run);
    if (hooks.stop && hooks.stop()) run.Stop();
    FinishedRun finished = run.Finish();
    forget();
    Complete(&finished);
    saver.Stop();
    return finished;
  } catch (...) {
    forget();
    throw;
  }
}

}  // namespace deepuav
