#include "deepuav/assembly/live/pushed_run.h"

#include <opencv2/imgproc.hpp>

#include "deepuav/assembly/datasets/dataset_run.h"
#include "deepuav/assembly/live/live_limits.h"
#include "deepuav/assembly/settings/wrong_use.h"
#include "deepuav/geometry/camera_scale.h"
#include "deepuav/io/geodata/gnss_file.h"

namespace deepuav {
namespace {

constexpr int kMostWaiting = 10'000;

Camera WorkingCamera(const Camera& camera, double working_pixels) {
  const cv::Size size = WorkingSize({camera.width, camera.height}, working_pixels);
  return ScaledCamera(camera, size.width, size.height);
}

const PushRequest& Checked(const PushRequest& request, const RunOptions& options) {
  request.camera.Check("camera");
  CheckLocalising(options, request.map);
  if (request.queue_size < 1 || request.queue_size > kMostWaiting)
    throw WrongUse("queue of {} images: expected 1 to {}", request.queue_size, kMostWaiting);
  return request;
}

/// Nothing where none are gone on with. Images are then seen as theirs were.
std::optional<LoadedAtlas> MapsOf(const PushRequest& request, RunOptions* options) {
  if (request.map.empty()) return std::nullopt;
  const Camera working = WorkingCamera(request.camera, options->images.working_pixels);
  LoadedAtlas loaded = LoadMaps(request.map, working, request.calibration.focal_sigma > 0);
  if (const auto pixels = PixelsSeenBefore(loaded.origin, options->features))
    options->features.LimitPixels(*pixels);
  return loaded;
}

std::unique_ptr<RunSettings> BoundedIfLive(std::unique_ptr<RunSettings> settings,
                                           Schedule schedule) {
  if (schedule == Schedule::kLive) BoundRecords(&settings->options.system);
  return settings;
}

PushedImagesOptions QueueOf(const PushRequest& request, const SystemOptions& options,
                            size_t kept_samples) {
  PushedImagesOptions queue;
  queue.capacity = static_cast<size_t>(request.queue_size);
  queue.newest_only = request.schedule == "live";
  queue.with_turns = request.imu.has_value();
  queue.max_imu_gap_s = options.sensors.imu.max_imu_gap_s;
  queue.max_wait_s = request.max_imu_wait_s;
  queue.kept_samples = kept_samples;
  return queue;
}

/// As its images are to be treated while they wait.
Camera QueuedCamera(Camera camera, const PushRequest& request) {
  if (!request.imu_is_synchronised) camera.readout_s = 0;
  return camera;
}

void CheckGrows(Timestamp last, Timestamp time, const char* what) {
  if (last < time) return;
  throw Error("{} of time {} ns: expected a later time than {} ns, the last one's", what,
              time.nanoseconds, last.nanoseconds);
}

}  // namespace

PushedRun::PushedRun(const PushRequest& request, std::unique_ptr<RunSettings> settings,
                     const PushHooks& hooks)
    : request_(Checked(request, settings->options)),
      asked_to_stop_(hooks.stop),
      schedule_(ParseSchedule(request_.schedule)),
      settings_(BoundedIfLive(std::move(settings), schedule_)),
      kept_samples_(schedule_ == Schedule::kLive ? kLiveSamples : 0),
      loaded_(MapsOf(request_, &settings_->options)),
      camera_(loaded_ ? loaded_->camera
                      : WorkingCamera(request_.camera, settings_->options.images.working_pixels)),
      eyes_(camera_, settings_->options),
      images_(QueuedCamera(camera_, request_), request_.imu.value_or(ImuStream{}),
              QueueOf(request_, settings_->options.system, kept_samples_)),
      gnss_(request_.gnss),
      barometer_(request_.barometer) {
  if (loaded_) CheckNetwork(request_.map, *loaded_, eyes_);
  const SystemOptions& options = settings_->options.system;
  run_.facts = FactsOf(eyes_, *settings_);
  run_.facts.dataset_kind = request_.kind;
  run_.facts.dataset_path = request_.source;
  run_.facts.schedule = request_.schedule;
  run_.facts.use = "auto";
  run_.facts.map_origin = OriginOf(loaded_, eyes_, options.localise_only);
  run_.facts.first_new_keyframe = KeyframeId{loaded_ ? loaded_->atlas.ids().keyframes : 0};
  facts_before_ = run_.facts;
  slam_.emplace(camera_, options, eyes_.perception());
  if (loaded_) slam_->Load(std::move(loaded_->atlas));
  slam_->UseSensorsAtEnd([this] { return TakeSensors(); });
  slam_->Observe(hooks.observer);
  if (hooks.save_due) {
    slam_->SaveWhenDue(hooks.save_due, [this, save = hooks.save](SlamResult result, Atlas atlas) {
      save(Meanwhile(std::move(result), std::move(atlas)));
    });
  }
  thread_ = std::thread([this] { Work(&*slam_); });
}

PushedRun::~PushedRun() {
  stop_ = true;
  images_.Abandon();
  if (thread_.joinable()) thread_.join();
}

void PushedRun::Work(Slam* slam) {
  const auto progress = [&](const FrameRecord&) {
    if (run_.facts.start_up_s == 0) run_.facts.start_up_s = running_.Seconds();
  };
  try {
    run_.result = slam->Run(&images_, schedule_, progress,
                            [this] { return stop_ || (asked_to_stop_ && asked_to_stop_()); });
  } catch (const std::exception& error) {
    run_.result.failure = error.what();
  }
  run_.facts.wall_s = running_.Seconds();
  has_ended_ = true;
  images_.Abandon();
}

SensorStreams PushedRun::TakeSensors() {
  images_.Close();
  const std::scoped_lock lock(mutex_);
  SensorStreams streams{images_.TakeImu(), std::move(gnss_), std::move(barometer_), {}};
  SensorUse use = ChooseSensors("auto", std::move(streams));
  run_.facts.sensors = std::move(use.facts);
  return std::move(use.streams);
}

void PushedRun::Feed(const GreyImage& image, Timestamp time) {
  const Camera& given = request_.camera;
  if (image.cols != given.width || image.rows != given.height) {
    throw Error("image of time {} ns is {}x{}: expected {}x{} as the camera's", time.nanoseconds,
                image.cols, image.rows, given.width, given.height);
  }
  const Stopwatch reducing;
  GreyImage working = image;
  if (camera_.width != given.width || camera_.height != given.height) {
    working = GreyImage();
    cv::resize(image, working, cv::Size(camera_.width, camera_.height), 0, 0, cv::INTER_AREA);
  }
  if (!images_.Push(std::move(working), time, reducing.Seconds())) ThrowEnded();
}

void PushedRun::ThrowEnded() const {
  if (has_ended_ && !run_.result.failure.empty())
    throw Error("the run has ended: {}", run_.result.failure);
  throw Error("the run was finished: expected images before that");
}

void PushedRun::FeedImu(const ImuSample& sample) {
  if (!request_.imu)
    throw WrongUse("inertial sample: expected its sensor's place and noise when the run was made");
  images_.PushImu(sample);
}

void PushedRun::FeedFix(const GnssFix& fix) {
  CheckOnGlobe(fix, "position fix");
  const std::scoped_lock lock(mutex_);
  if (!gnss_.fixes.empty()) CheckGrows(gnss_.fixes.back().time, fix.time, "position fix");
  gnss_.fixes.push_back(fix);
  ForgetOldest(kept_samples_, &gnss_.fixes);
}

void PushedRun::FeedBarometer(const BarometerSample& sample) {
  if (!IsPossibleAltitude(sample.altitude_m))
    throw Error("barometer sample: altitude is {} m: no aircraft flies there", sample.altitude_m);
  const std::scoped_lock lock(mutex_);
  if (!barometer_.samples.empty())
    CheckGrows(barometer_.samples.back().time, sample.time, "barometer sample");
  barometer_.samples.push_back(sample);
  ForgetOldest(kept_samples_, &barometer_.samples);
}

void PushedRun::Stop() {
  stop_ = true;
  images_.Abandon();
}

FinishedRun PushedRun::Meanwhile(SlamResult result, Atlas atlas) const {
  result.skipped_late = images_.skipped();
  FinishedRun run{std::move(result), std::move(atlas), camera_, facts_before_};
  run.facts.images = images_.pushed();
  run.facts.wall_s = running_.Seconds();
  run.facts.calibration =
      DescribeCalibration(request_.camera, request_.calibration.text, camera_, request_.lens);
  return run;
}

FinishedRun PushedRun::Finish() {
  if (is_finished_) throw WrongUse("the run was finished before: expected Finish once");
  is_finished_ = true;
  images_.Close();
  thread_.join();
  run_.facts.images = images_.pushed();
  run_.result.skipped_late = images_.skipped();
  run_.atlas = slam_->TakeAtlas();
  run_.camera = slam_->camera();
  run_.facts.calibration =
      DescribeCalibration(request_.camera, request_.calibration.text, run_.camera,
                          RefinedBy(run_.result, run_.camera, request_.lens));
  return std::move(run_);
}

}  // namespace deepuav
