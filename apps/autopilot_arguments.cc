#include "autopilot_arguments.h"

#include "deepuav/assembly/wrong_use.h"
#include "deepuav/autopilot/constant_velocity.h"
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

OdometryEstimator EstimatorFor(const SE3& body_from_cam) {
  return {body_from_cam, OdometryOptions{}, std::make_unique<ConstantVelocity>()};
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

AutopilotTeller::AutopilotTeller(const AutopilotArguments& arguments, const SE3& body_from_cam)
    : observer_(EstimatorFor(body_from_cam)),
      link_(ParseLinkAddress(arguments.address), arguments.options,
            [this](int64_t now_ns) { return observer_.At(now_ns); }) {}

std::unique_ptr<AutopilotTeller> StartAutopilot(const AutopilotArguments& arguments,
                                                const LiveRequest& request, const LiveRun& live) {
  if (arguments.address.empty()) return nullptr;
  if (request.pace.speed != 1)
    throw WrongUse("--mavlink: speeds are those of a vehicle only at --speed 1");
  return std::make_unique<AutopilotTeller>(arguments, MountOf(arguments, live));
}

std::unique_ptr<MetricWatch> WatchMetric(const LiveRun& live, const InertialOptions& options,
                                         AutopilotTeller* teller) {
  std::optional<ImuStream> imu = live.Imu();
  if (!imu) return nullptr;
  AutopilotObserver* const observer = teller->observer();
  return std::make_unique<MetricWatch>(
      std::move(*imu), options, [observer](MapId map, int64_t revision, const MetricWorld& world) {
        observer->UseMetric(map, revision,
                            MetricFromMap{world.metric_from_world, world.scale_sigma, {}});
      });
}

}  // namespace deepuav
