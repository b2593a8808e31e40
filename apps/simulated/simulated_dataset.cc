#include "simulated/simulated_dataset.h"

#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/io/datasets/euroc_writer.h"
#include "deepuav/io/files/atomic_file.h"
#include "deepuav/io/files/options_file.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/simulation/flight/flight_plan.h"
#include "deepuav/simulation/sensors/sensor_clock.h"
#include "deepuav/simulation/sensors/sensor_noise.h"
#include "simulated/simulated_orthophoto.h"
#include "simulated/truth_images.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr Timestamp kStart{1'700'000'000'000'000'000};
constexpr size_t kMaxOptionsBytes = size_t{1} << 20;

enum Stream { kWind, kImu, kGnss, kBarometer };

std::unique_ptr<FlightPath> MakePath(const SimulationOptions& options, const World& world) {
  Random random = StreamOf(options.flight.seed, kWind);
  return PlanFlight(options.course, options.attitude, options.wind, world, &random);
}

RenderOptions MakeRenderOptions(const SimulationOptions& options, int threads) {
  RenderOptions render;
  render.sensor = options.sensor;
  render.weather = options.weather;
  render.seed = options.flight.seed;
  render.threads = threads;
  return render;
}

void MakeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error("{}: cannot be made: {}", folder.string(), error.message());
}

// A file of an earlier program may lack options: they stand at their defaults then.
bool IsSameFlight(const fs::path& options_file, const std::string& options_yaml) {
  if (ReadBytes(options_file, kMaxOptionsBytes) == options_yaml) return true;
  SimulationOptions written;
  OptionRegistry registry;
  written.Register(&registry);
  try {
    LoadOptionsFile(options_file, &registry);
  } catch (const Error&) {  // of a later program, or damaged
    return false;
  }
  return OptionsAsYaml(registry) == options_yaml;
}

bool IsThere(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error) && fs::file_size(file, error) > 0;
}

}  // namespace

SimulatedDataset::SimulatedDataset(const SimulationOptions& options, const fs::path& folder,
                                   int threads)
    : options_(options),
      folder_(folder),
      mav0_(folder / "mav0"),
      threads_(threads),
      camera_(MakeCamera(options)),
      body_from_cam_(BodyFromCam(options.mount)),
      world_(options.scene),
      path_(MakePath(options, world_)),
      renderer_(world_, camera_, MakeRenderOptions(options, threads)) {
  duration_s_ = std::min(options.flight.duration_s, path_->duration_s());
  frame_count_ = SampleCount(duration_s_, camera_.rate_hz);
}

std::string SimulatedDataset::FrameName(int frame) const {
  return std::to_string(After(kStart, FrameTime(frame)).nanoseconds);
}

void SimulatedDataset::WriteSensors(const std::string& options_yaml) const {
  const fs::path options_file = folder_ / "simulation.yaml";
  const bool goes_on = fs::exists(options_file);
  if (goes_on && !IsSameFlight(options_file, options_yaml)) {
    throw Error(
        "{}: holds a flight of other options: expected the same ones, to go on with it, another "
        "folder, or this one removed",
        folder_.string());
  }
  for (const char* sensor : {"cam0", "depth0", "flow0"}) {
    const std::string name = sensor;
    if (name == "depth0" && !options_.output.depth) continue;
    if (name == "flow0" && !options_.output.flow) continue;
    MakeFolder(mav0_ / name / "data");
  }
  if (!goes_on) WriteFileAtomically(options_file, options_yaml);
  WriteImuAndBodyTruth();
  WriteCameraTruthFile();
  if (options_.gnss.present) {
    Random gnss_random = StreamOf(options_.flight.seed, kGnss);
    WriteEurocGnss(mav0_, options_.gnss.rate_hz, options_.gnss.Lever(),
                   SimulateGnss(*path_, options_.gnss, duration_s_, kStart, &gnss_random));
  }
  Random barometer_random = StreamOf(options_.flight.seed, kBarometer);
  WriteEurocBarometer(mav0_, options_.barometer.rate_hz,
                      SimulateBarometer(*path_, options_.barometer, options_.gnss.origin_altitude_m,
                                        duration_s_, kStart, &barometer_random));
  WriteTruthSensors();
}

void SimulatedDataset::WriteImuAndBodyTruth() const {
  Random random = StreamOf(options_.flight.seed, kImu);
  const std::vector<SimulatedImuSample> simulated =
      SimulateImu(*path_, options_.imu, duration_s_, kStart, &random);
  std::vector<ImuSample> measured;
  std::vector<TimedBodyState> truth;
  for (const SimulatedImuSample& sample : simulated) {
    measured.push_back(sample.measured);
    truth.push_back({sample.measured.time, sample.truth.world_from_body,
                     sample.truth.velocity_world, sample.gyroscope_bias,
                     sample.accelerometer_bias});
  }
  const ImuOptions& imu = options_.imu;
  WriteEurocImu(mav0_, imu.rate_hz,
                {imu.gyroscope_noise_density, imu.gyroscope_random_walk,
                 imu.accelerometer_noise_density, imu.accelerometer_random_walk},
                measured);
  WriteEurocBodyTruth(mav0_, truth);
}

void SimulatedDataset::WriteCameraTruthFile() const {
  Trajectory trajectory;
  for (int frame = 0; frame < frame_count_; ++frame) {
    const double time_s = FrameTime(frame);
    trajectory.push_back(
        {After(kStart, time_s), path_->At(time_s).world_from_body * body_from_cam_});
  }
  WriteCameraTruth(folder_, trajectory);
}

void SimulatedDataset::WriteTruthSensors() const {
  if (options_.output.depth) {
    WriteFileAtomically(
        mav0_ / "depth0" / "sensor.yaml",
        fmt::format(
            "sensor_type: depth\ncomment: along the optical axis of cam0, 16 bit, 0 for the "
            "sky or too far\ndepth_unit_m: {}\n",
            options_.output.depth_unit_m));
  }
  if (options_.output.flow) {
    WriteFileAtomically(mav0_ / "flow0" / "sensor.yaml",
                        "sensor_type: optical_flow\ncomment: of cam0 to its next image, px, as in "
                        "KITTI: red (x) and "
                        "green (y) are (value - 32768) / 64, blue is 1 where there is one\n");
  }
}

TruthRequest SimulatedDataset::RequestFor(int frame) const {
  TruthRequest request;
  request.depth = options_.output.depth;
  request.moving = moving_masks_;
  if (options_.output.flow && frame + 1 < frame_count_)
    request.flow_to_time_s = FrameTime(frame + 1);
  return request;
}

void SimulatedDataset::AddMovingMasks() {
  MakeFolder(mav0_ / "moving0" / "data");
  WriteFileAtomically(
      mav0_ / "moving0" / "sensor.yaml",
      fmt::format("sensor_type: moving_mask\ncomment: truth, no mask of the camera: "
                  "what each pixel of cam0 shows\nmoving: {}\n"
                  "standing_in_moving_shadow: {}\nstanding: {}\n",
                  int{kMoving}, int{kMovingShadow}, int{kStanding}));
  moving_masks_ = true;
}

bool SimulatedDataset::WriteFrame(int frame) {
  const std::string name = FrameName(frame);
  TruthRequest request = RequestFor(frame);
  const fs::path image = mav0_ / "cam0" / "data" / (name + "." + options_.output.image_format);
  const fs::path depth = mav0_ / "depth0" / "data" / (name + ".png");
  const fs::path flow = mav0_ / "flow0" / "data" / (name + ".png");
  const fs::path moving = mav0_ / "moving0" / "data" / (name + ".png");
  request.picture = !IsThere(image);
  if (!request.picture && (!request.depth || IsThere(depth)) &&
      (!request.moving || IsThere(moving)) && (!request.flow_to_time_s || IsThere(flow))) {
    return false;
  }
  const PathOfCamera path = [this](double time_s) {
    return path_->At(time_s).world_from_body * body_from_cam_;
  };
  const Rendered rendered = renderer_.Render(path, FrameTime(frame), frame, request);
  if (request.depth)
    WriteFileAtomically(depth, EncodeDepth(rendered.depth_m, options_.output.depth_unit_m));
  if (request.flow_to_time_s) WriteFileAtomically(flow, EncodeFlow(rendered.flow_px));
  if (request.moving) WriteFileAtomically(moving, EncodeMask(rendered.moving));
  if (request.picture) {
    WriteFileAtomically(image, EncodeImage(rendered.image, options_.output.image_format,
                                           options_.output.jpeg_quality));
  }
  return true;
}

void SimulatedDataset::WriteOrthophoto(int frames, double cell_m) const {
  std::vector<Eigen::Vector3d> positions;
  for (int frame = 0; frame < frames; ++frame) {
    positions.push_back(
        (path_->At(FrameTime(frame)).world_from_body * body_from_cam_).translation());
  }
  WriteTrueOrthophoto(folder_, world_, options_, positions, cell_m, threads_);
}

void SimulatedDataset::WriteFrameList(int frames) const {
  std::vector<EurocImageName> images;
  for (int frame = 0; frame < frames; ++frame) {
    images.push_back(
        {After(kStart, FrameTime(frame)), FrameName(frame) + "." + options_.output.image_format});
  }
  WriteEurocCamera(mav0_, camera_, body_from_cam_, images);
}

}  // namespace deepuav
