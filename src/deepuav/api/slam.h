#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/api/observer.h"
#include "deepuav/api/options.h"
#include "deepuav/api/types.h"

namespace deepuav::api {

/// Where an inertial sensor is, and its continuous noise; 0: not stated.
struct ImuSensor {
  Pose camera_from_imu;
  double gyroscope_noise_density = 0;      ///< rad/s/sqrt(Hz)
  double gyroscope_random_walk = 0;        ///< rad/s^2/sqrt(Hz)
  double accelerometer_noise_density = 0;  ///< m/s^2/sqrt(Hz)
  double accelerometer_random_walk = 0;    ///< m/s^3/sqrt(Hz)
};

/// Of an EuRoC sequence, by the sensor.yaml of its camera and of its inertial sensor. Throws Error
/// naming file and field.
DEEPUAV_API ImuSensor ReadImuSensor(const std::string& camera_file, const std::string& imu_file);

/// Where a receiver's antenna is, and how far its clock may be from the camera's.
struct GnssSensor {
  Vector3 antenna_camera_m;
  double clock_sigma_s = 0;
};

/// How a run is done.
struct RunSetup {
  /// sequential: in one thread; threaded: the same bytes, sooner; live: the newest image is taken,
  /// the result depends on time.
  std::string schedule = "threaded";
  std::string map;               ///< A map.deepuav to go on with, or empty.
  int queue_size = 4;            ///< Images that may wait, 1 to 10000; live: one does.
  std::optional<ImuSensor> imu;  ///< Nothing: FeedImu is refused.
  GnssSensor gnss;
  Vector3 barometer_camera_m;
  Observer* observer = nullptr;  ///< Null: none. Must live until the run is finished or destroyed.
};

struct DatasetSetup;

/// What a run leaves behind. Const use is thread-safe.
class DEEPUAV_API Result {
 public:
  Result(Result&& other) noexcept;
  Result& operator=(Result&& other) noexcept;
  ~Result();

  /// Of every image that was not left out, by time.
  std::vector<Frame> Frames() const;
  /// Of all maps, by map and id.
  std::vector<Keyframe> Keyframes() const;
  std::vector<Landmark> Landmarks() const;
  std::vector<MapInfo> Maps() const;
  /// The map in which most frames lie; -1: there is none.
  int MainMap() const;
  /// As given, or refined by the run.
  Camera FinalCamera() const;
  /// What ended the run early; empty: nothing did. The result until then is complete.
  std::string Failure() const;
  /// The summary.json of Write.
  std::string SummaryJson() const;
  /// Writes the output folder that `deepuav run` writes, made if absent. Each file appears only
  /// once it is complete. Throws Error naming the first file that could not be written.
  void Write(const std::string& folder) const;

 private:
  friend class Slam;
  friend Result Run(const DatasetSetup& setup, const Options& options);
  struct Data;
  explicit Result(std::unique_ptr<Data> data);
  std::unique_ptr<Data> data_;
};

/// SLAM over images that are pushed. One run an instance. Thread-safe: images may come from one
/// thread while samples of sensors come from others; Finish is called once nothing else is.
class DEEPUAV_API Slam {
 public:
  /// `camera` is that of the images as they are pushed; larger ones are reduced as the option
  /// images.working_pixels says. Loads the networks. Throws Error for what cannot be, is missing or
  /// does not fit.
  explicit Slam(const Camera& camera, const Options& options = {}, const RunSetup& setup = {});
  Slam(Slam&& other) noexcept;
  Slam& operator=(Slam&& other) noexcept;
  /// Gives up a run that was not finished, within a few seconds (system.finish_stopped_s).
  ~Slam();

  /// Copies the image; times grow. Waits while the queue is full; live it never waits, and an image
  /// that still waits is left out for this one. Throws Error for an image of another size than the
  /// camera's, a time that does not grow, and once the run has ended early.
  void Feed(const ImageView& image, std::int64_t time_ns);

  /// Samples of other sensors, each by growing time. They give the maps scale, level and place at
  /// the end of the run, so they may come at any time before Finish; an observer is told of metres
  /// (FrameEvent::metric) by those that come with the images. One use of inertial samples is
  /// earlier: where the camera has a readout, an image waits for those up to the end of its
  /// readout. If none come, it goes without them once the queue is full and another image waits
  /// to be fed (live: once it was overtaken). So a run is the same to the byte as one that knew all
  /// samples before, if each image's samples are fed before queue_size more images are.
  /// Throws Error for times that do not grow and numbers that cannot be.
  void FeedImu(const ImuSample& sample);
  void FeedFix(const GnssFix& fix);
  void FeedBarometer(const BarometerSample& sample);

  /// Waits for the run to end after the last image: the maps are adjusted and every frame gets its
  /// final pose. Once. Throws Error where it was finished before.
  Result Finish();

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

/// Which dataset Run does.
struct DatasetSetup {
  std::string dataset;  ///< Folder or video file, as of `deepuav run`.
  std::string camera;   ///< A camera.yaml that overrides the dataset's calibration, or empty.
  std::string map;      ///< A map.deepuav to go on with, or empty.
  std::string schedule = "threaded";
  std::string use = "auto";             ///< Sensors, as of --use.
  int start = 0, end = -1, stride = 1;  ///< Of the frames; end -1: all.
  /// Null: none. Photographs that are mapped all at once have no pose when it is told of them; maps
  /// and their keyframes follow when they are done.
  Observer* observer = nullptr;
  /// Asked at each image and more often, by several of the run's threads at once: whether to end.
  /// Then no more images are looked at, and the result is that of those before, within a few
  /// seconds (system.finish_stopped_s). Must not throw. Empty: never.
  std::function<bool()> stop = {};
};

/// SLAM over a dataset: the same bytes as `deepuav run`. May be called from several threads. Throws
/// Error as Slam does, and for a dataset that cannot be read.
DEEPUAV_API Result Run(const DatasetSetup& setup, const Options& options = Options());

}  // namespace deepuav::api
