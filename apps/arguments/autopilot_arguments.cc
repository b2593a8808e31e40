#include "arguments/autopilot_arguments.h"

#include "deepuav/assembly/settings/wrong_use.h"
#include "deepuav/autopilot/inertial_prediction.h"
#include "deepuav/autopilot/mount.h"
#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr const char* kOfDataset = "dataset";

/// An empty text where `parse` takes what is written, else why not.
template <typename Parse>
CLI::Validator Parsed(Parse parse) {
  return CLI::Validator(
      [parse](const std::string& text) -> std::string {
        try {
          parse(text);
        } catch (const Error& error) {
          return error.what();
        }
        return {};
      },
      "");
}

SE3 MountOf(const AutopilotArguments& arguments, const LiveRun& live) {
  if (arguments.mount != kOfDataset)
    return {ParseMount(arguments.mount), ParseMountOffset(arguments.mount_offset)};
  const std::optional<SE3> body_from_cam = live.BodyFromCam();
  if (!body_from_cam)
    throw WrongUse(
        "--mount dataset: {} does not say how the camera is mounted: expected a "
        "dataset with T_BS",
        live.SourceName());
  return MountOfRosBody(*body_from_cam);
}

/// The autopilot's: its body is the sensor's frame, and its noise is what the options say.
ImuStream SensorOf(const AutopilotArguments& arguments, const SE3& body_from_cam) {
  ImuStream sensor;
  sensor.source = "the autopilot at " + arguments.address;
  sensor.cam_from_imu = body_from_cam.Inverse();
  return sensor;
}

GnssStream ReceiverOf(const AutopilotArguments& arguments, const SE3& body_from_cam) {
  GnssStream receiver;
  receiver.source = "the autopilot at " + arguments.address;
  receiver.antenna_cam_m = body_from_cam.Inverse() * ParseMountOffset(arguments.antenna);
  receiver.clock_sigma_s = arguments.options.gnss.clock_sigma_s;
  return receiver;
}

/// Null where no sensor says more of the map.
std::unique_ptr<WorldWatch> WatchWorld(SensorsOnTheWay sensors, const SensorUseOptions& options,
                                       AutopilotObserver* observer) {
  if (!sensors.imu && !sensors.gnss) return nullptr;
  return std::make_unique<WorldWatch>(
      std::move(sensors.imu), std::move(sensors.gnss), options,
      [observer](MapId map, int64_t revision, const MetricFromMap& metric) {
        observer->UseMetric(map, revision, metric);
      });
}

OdometryEstimator EstimatorFor(const SE3& body_from_cam) {
  return {body_from_cam, OdometryOptions{}, std::make_unique<InertialPrediction>()};
}

}  // namespace

void AddAutopilotArguments(CLI::App& command, AutopilotArguments& arguments) {
  CLI::Option* mavlink = command
                             .add_option("--mavlink", arguments.address,
                                         "Tell an autopilot where the vehicle is: udp:HOST:PORT")
                             ->check(Parsed(ParseLinkAddress));
  command
      .add_flag("--mavlink-vision", arguments.options.vision_position,
                "By VISION_POSITION_ESTIMATE in place of ODOMETRY")
      ->needs(mavlink);
  command
      .add_flag("--mavlink-imu", arguments.options.imu.wanted,
                "Ask the autopilot for its inertial samples, which give the map metres")
      ->needs(mavlink);
  CLI::Option* gnss = command
                          .add_flag("--mavlink-gnss", arguments.options.gnss.wanted,
                                    "Ask the autopilot for its position fixes, which give the map "
                                    "its place on Earth")
                          ->needs(mavlink);
  command
      .add_option("--mavlink-antenna", arguments.antenna,
                  "Where the antenna is, from the autopilot: metres forward,right,down")
      ->check(Parsed(ParseMountOffset))
      ->capture_default_str()
      ->needs(gnss);
  command.add_option("--mavlink-system", arguments.options.system_id, "Number of the vehicle")
      ->check(CLI::Range(1, 255).description(""))
      ->capture_default_str()
      ->needs(mavlink);
  command
      .add_option("--mount", arguments.mount,
                  "How the camera looks from the vehicle: forward, down, ROLL,PITCH,YAW in degrees "
                  "from forward (0,-30,0: 30 degrees down), or dataset: its T_BS, of a body of x "
                  "forward, y left, z up")
      ->check(Parsed([](const std::string& text) {
        if (text != kOfDataset) ParseMount(text);
      }))
      ->capture_default_str()
      ->needs(mavlink);
  command
      .add_option("--mount-offset", arguments.mount_offset,
                  "Where the camera is, from the autopilot: metres forward,right,down")
      ->check(Parsed(ParseMountOffset))
      ->capture_default_str()
      ->needs(mavlink);
}

AutopilotTeller::AutopilotTeller(const AutopilotArguments& arguments, const SE3& body_from_cam,
                                 SensorsOnTheWay sensors, const SensorUseOptions& options,
                                 LiveRun* live)
    : live_(live),
      observer_(EstimatorFor(body_from_cam)),
      watch_(WatchWorld(std::move(sensors), options, &observer_)),
      link_(
          ParseLinkAddress(arguments.address), arguments.options,
          [this](int64_t now_ns) { return observer_.At(now_ns); }, Ears()) {}

AutopilotListener AutopilotTeller::Ears() {
  return {.inertial = [this](const ImuSample& sample) { Take(sample); },
          .fix = [this](const GnssFix& fix) { Take(fix); },
          .origin = [this](const GeoPoint& origin) { watch_->UseOrigin(origin); }};
}

void AutopilotTeller::Take(const ImuSample& sample) {
  observer_.AddInertial(sample);
  const std::optional<ImuSample> among_images = observer_.AmongImages(sample);
  if (!among_images) return;
  live_->FeedImu(*among_images);
  watch_->AddSample(*among_images);
}

void AutopilotTeller::Take(const GnssFix& fix) {
  const std::optional<GnssFix> among_images = observer_.FixAmongImages(fix);
  if (!among_images) return;
  live_->FeedFix(*among_images);
  watch_->AddFix(*among_images);
}

std::unique_ptr<AutopilotTeller> StartAutopilot(const AutopilotArguments& arguments,
                                                const LiveRequest& request,
                                                const SensorUseOptions& options, LiveRun* live) {
  if (arguments.address.empty()) return nullptr;
  if (request.pace.speed != 1)
    throw WrongUse("--mavlink: speeds are those of a vehicle only at --speed 1");
  const SE3 body_from_cam = MountOf(arguments, *live);
  SensorsOnTheWay sensors;
  if (arguments.options.imu.wanted) {
    sensors.imu = SensorOf(arguments, body_from_cam);
    live->ExpectImu(*sensors.imu);
  } else {
    sensors.imu = live->Imu();
  }
  if (arguments.options.gnss.wanted) {
    sensors.gnss = ReceiverOf(arguments, body_from_cam);
    live->ExpectGnss(*sensors.gnss);
  } else {
    sensors.gnss = live->Gnss();
  }
  return std::make_unique<AutopilotTeller>(arguments, body_from_cam, std::move(sensors), options,
                                           live);
}

}  // namespace deepuav
