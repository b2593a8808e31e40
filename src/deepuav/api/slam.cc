#include "deepuav/api/slam.h"

#include <utility>

#include "deepuav/api/conversions.h"
#include "deepuav/api/event_queue.h"
#include "deepuav/api/guarded.h"
#include "deepuav/api/options_data.h"
#include "deepuav/assembly/datasets/dataset_run.h"
#include "deepuav/assembly/live/pushed_run.h"
#include "deepuav/assembly/output/run_summary.h"
#include "deepuav/io/datasets/euroc_sensor.h"
#include "deepuav/io/files/folder_lock.h"
#include "deepuav/io/geodata/sensor_files.h"
#include "deepuav/system/sensors/world_watch.h"
#include "deepuav/system/watching/observer_list.h"

namespace deepuav::api {
namespace {

PushRequest RequestOf(const Camera& camera, const RunSetup& setup) {
  PushRequest request;
  request.camera = ToCore(camera);
  request.schedule = setup.schedule;
  request.map = setup.map;
  request.queue_size = setup.queue_size;
  constexpr const char* kSource = "pushed samples";
  if (const auto& imu = setup.imu) {
    request.imu = ImuStream{kSource,
                            {imu->gyroscope_noise_density, imu->gyroscope_random_walk,
                             imu->accelerometer_noise_density, imu->accelerometer_random_walk},
                            ToCore(imu->camera_from_imu),
                            {}};
  }
  request.gnss.source = request.barometer.source = kSource;
  request.gnss.antenna_cam_m = ToCore(setup.gnss.antenna_camera_m);
  request.gnss.clock_sigma_s = setup.gnss.clock_sigma_s;
  request.barometer.sensor_cam_m = ToCore(setup.barometer_camera_m);
  return request;
}

/// `burst`: so many things may happen at once besides.
std::unique_ptr<EventQueue> QueueFor(Observer* observer, size_t burst = 0) {
  constexpr size_t kWaiting = 256;
  return observer ? std::make_unique<EventQueue>(observer, kWaiting + burst) : nullptr;
}

/// Of the sensors that are fed.
std::unique_ptr<WorldWatch> WatchFor(EventQueue* events, const PushRequest& request,
                                     const SensorUseOptions& options) {
  if (!events) return nullptr;
  return std::make_unique<WorldWatch>(
      request.imu, request.gnss, options,
      [events](MapId map, int64_t revision, const MetricFromMap& metric) {
        events->UseMetric(map, revision, metric);
      });
}

std::vector<Frame> FramesOf(const FinishedRun& run) {
  const auto numbers = NumbersInFile(run.atlas);
  std::vector<Frame> frames;
  for (const FrameRecord& record : run.result.frames) {
    Frame frame = FrameOf(record);
    if (record.located()) frame.map = static_cast<int>(numbers.at(run.atlas.Current(record.map)));
    frames.push_back(std::move(frame));
  }
  return frames;
}

}  // namespace

struct Result::Data {
  FinishedRun run;
};

struct Slam::Data {
  Data(const Camera& camera, const Options& options, const RunSetup& setup)
      : Data(RequestOf(camera, setup), Access::Settings(options), QueueFor(setup.observer)) {}
  Data(const PushRequest& request, std::unique_ptr<RunSettings> settings,
       std::unique_ptr<EventQueue> queue)
      : events(std::move(queue)),
        watch(WatchFor(events.get(), request, settings->options.system.sensors)),
        run(request, std::move(settings), {Observe(), {}, {}, {}}) {}

  RunObserver* Observe() {
    if (!events) return nullptr;
    observers.Add(events.get());
    observers.Add(watch.get());
    return &observers;
  }

  std::unique_ptr<EventQueue> events;  ///< Null where nobody looks on...
  std::unique_ptr<WorldWatch> watch;   ///< ...as this. Tells the other.
  ObserverList observers;
  PushedRun run;
};

ImuSensor ReadImuSensor(const std::string& camera_file, const std::string& imu_file) {
  return Guarded([&] {
    const SE3 cam_from_body = ReadEurocBodyFromSensor(camera_file).Inverse();
    const ImuNoise noise = ReadImuNoise(imu_file);
    return ImuSensor{ToApi(cam_from_body * ReadEurocBodyFromSensor(imu_file)),
                     noise.gyroscope_noise_density, noise.gyroscope_random_walk,
                     noise.accelerometer_noise_density, noise.accelerometer_random_walk};
  });
}

Result::Result(std::unique_ptr<Data> data) : data_(std::move(data)) {}
Result::Result(Result&& other) noexcept = default;
Result& Result::operator=(Result&& other) noexcept = default;
Result::~Result() = default;

std::vector<Frame> Result::Frames() const {
  return Guarded([&] { return FramesOf(data_->run); });
}

std::vector<Keyframe> Result::Keyframes() const {
  return Guarded(
      [&] { return KeyframesOf(data_->run.atlas, data_->run.facts.map_origin.image_names); });
}

std::vector<Landmark> Result::Landmarks() const {
  return Guarded([&] { return LandmarksOf(data_->run.atlas); });
}

std::vector<MapInfo> Result::Maps() const {
  return Guarded([&] { return MapsOf(data_->run.atlas); });
}

int Result::MainMap() const {
  return Guarded([&] {
    const MapId main = core::MainMap(FramesByMap(data_->run.atlas, data_->run.result));
    return main.valid() ? static_cast<int>(NumbersInFile(data_->run.atlas).at(main)) : -1;
  });
}

Camera Result::FinalCamera() const {
  return Guarded([&] { return ToApi(data_->run.facts.calibration.camera); });
}

std::string Result::Failure() const {
  return Guarded([&] { return data_->run.result.failure; });
}

std::string Result::SummaryJson() const {
  const FinishedRun& run = data_->run;
  return Guarded([&] { return SummaryText(run.atlas, run.result, run.facts); });
}

void Result::Write(const std::string& folder) const {
  Guarded([&] {
    MakeOutputFolder(folder);
    const FolderLock lock(folder);
    WriteRunOutput(folder, data_->run);
  });
}

Slam::Slam(const Camera& camera, const Options& options, const RunSetup& setup)
    : data_(Guarded([&] { return std::make_unique<Data>(camera, options, setup); })) {}
Slam::Slam(Slam&& other) noexcept = default;
Slam& Slam::operator=(Slam&& other) noexcept = default;
Slam::~Slam() = default;

void Slam::Feed(const ImageView& image, std::int64_t time_ns) {
  Guarded([&] { data_->run.Feed(GreyOf(image), {time_ns}); });
}

void Slam::FeedImu(const ImuSample& sample) {
  Guarded([&] {
    const core::ImuSample of_core{{sample.time_ns},
                                  ToCore(sample.angular_velocity_rad_s),
                                  ToCore(sample.specific_force_m_s2)};
    data_->run.FeedImu(of_core);
    if (data_->watch) data_->watch->AddSample(of_core);
  });
}

void Slam::FeedFix(const GnssFix& fix) {
  Guarded([&] {
    const core::GnssFix of_core{
        {fix.time_ns}, fix.latitude_deg, fix.longitude_deg, fix.altitude_m, ToCore(fix.sigma_m)};
    data_->run.FeedFix(of_core);
    if (data_->watch) data_->watch->AddFix(of_core);
  });
}

void Slam::FeedBarometer(const BarometerSample& sample) {
  Guarded([&] { data_->run.FeedBarometer({{sample.time_ns}, 0, sample.altitude_m}); });
}

Result Slam::Finish() {
  return Guarded([&] {
    auto data = std::make_unique<Result::Data>();
    data->run = data_->run.Finish();
    data_->watch.reset();
    data_->events.reset();
    return Result(std::move(data));
  });
}

Result Run(const DatasetSetup& setup, const Options& options) {
  return Guarded([&] {
    DatasetRun run({setup.dataset,
                    setup.camera,
                    setup.map,
                    setup.schedule,
                    setup.use,
                    {setup.start, setup.end, setup.stride}},
                   Access::Settings(options));
    // The keyframes of a survey are all told in the end.
    const auto events =
        QueueFor(setup.observer, run.IsSurvey() ? static_cast<size_t>(run.images()) : 0);
    RunHooks hooks;
    hooks.observer = events.get();
    hooks.stop = setup.stop;
    auto data = std::make_unique<Result::Data>();
    data->run = run.Run(hooks);
    return Result(std::move(data));
  });
}

}  // namespace deepuav::api
