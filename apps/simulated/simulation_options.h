#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "deepuav/base/options.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/simulation/flight/camera_mount.h"
#include "deepuav/simulation/flight/course_options.h"
#include "deepuav/simulation/flight/quadrotor_path.h"
#include "deepuav/simulation/flight/wind_jitter.h"
#include "deepuav/simulation/rendering/render_options.h"
#include "deepuav/simulation/sensors/barometer.h"
#include "deepuav/simulation/sensors/gnss.h"
#include "deepuav/simulation/sensors/imu.h"
#include "deepuav/simulation/world/scene_options.h"

namespace deepuav {

struct FlightOptions {
  std::string about;
  std::string scene = "village";
  double duration_s = 60;
  int seed = 1;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("about", about, "", "one line on the flight");
    visit("scene", scene, "", "a scene's name, or its YAML file");
    visit("duration_s", duration_s, "s", "recorded at most, if the course is not flown before",
          Above(0, kLongestFlightS));
    visit("seed", seed, "", "of wind and noise of all sensors; the scene has one of its own",
          AnySeed());
  }
};

/// The camera as in a camera.yaml; defaults: EuRoC's cam0.
struct CameraOptions {
  std::string file;
  std::string model = "radial_tangential";
  int width = 752;
  int height = 480;
  double fx = 458.654;
  double fy = 457.296;
  double cx = 367.215;
  double cy = 248.375;
  std::string distortion = "-0.28340811 0.07395907 0.00019359 1.76187114e-05";
  double rate_hz = 20;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    constexpr double kSmallestSidePx = 8, kLargestSidePx = 8192, kLongestFocalPx = 1e6;
    visit("file", file, "", "a camera.yaml that takes the place of all other values but the rate");
    visit("model", model, "", "of the lens",
          OneOf({"pinhole", "radial_tangential", "equidistant"}));
    visit("width", width, "px", "of the images", Between(kSmallestSidePx, kLargestSidePx));
    visit("height", height, "px", "of the images", Between(kSmallestSidePx, kLargestSidePx));
    visit("fx", fx, "px", "focal length", Above(0, kLongestFocalPx));
    visit("fy", fy, "px", "focal length", Above(0, kLongestFocalPx));
    visit("cx", cx, "px", "principal point", Between(-kLongestFocalPx, kLongestFocalPx));
    visit("cy", cy, "px", "principal point", Between(-kLongestFocalPx, kLongestFocalPx));
    visit("distortion", distortion, "", "coefficients, separated by blanks");
    visit("rate_hz", rate_hz, "Hz", "images a second", Between(0.001, 1000));
  }
};

/// What is written, and how.
struct OutputOptions {
  std::string image_format = "jpg";
  int jpeg_quality = 92;
  bool depth = false;
  double depth_unit_m = 0.01;
  bool flow = false;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("image_format", image_format, "", "of the images", OneOf({"jpg", "png"}));
    visit("jpeg_quality", jpeg_quality, "", "of the images", Between(1, 100));
    visit("depth", depth, "", "write the depth of each image");
    visit("depth_unit_m", depth_unit_m, "m", "of the 16-bit depths", Between(1e-6, 1000));
    visit("flow", flow, "", "write the optical flow from each image to the next");
  }
};

/// All that makes a simulated dataset what it is.
struct SimulationOptions {
  FlightOptions flight;
  CourseOptions course;
  AttitudeOptions attitude;
  WindOptions wind;
  CameraOptions camera;
  CameraMountOptions mount;
  SensorOptions sensor;
  WeatherOptions weather;
  SceneOptions scene;
  ImuOptions imu;
  GnssOptions gnss;
  BarometerOptions barometer;
  OutputOptions output;

  void Check() const;
  void Register(OptionRegistry* registry);
};

/// What the command line says about them.
struct SimulationChoice {
  std::string flight;  ///< A shipped flight's name, or a YAML file.
  std::string scene;   ///< Overrides the flight's; empty: as the flight says.
  std::vector<std::string> assignments;
};

/// Reads the flight's file, the scene it names, and on top of that scene what the file and the
/// assignments say; checks all. `registry` must be of `options`. Throws Error.
void LoadSimulation(const SimulationChoice& choice, SimulationOptions* options,
                    OptionRegistry* registry);

/// The shipped flights by name, with what they say about themselves.
struct ListedFlight {
  std::string name, about;
};
std::vector<ListedFlight> ListFlights();

/// Throws Error naming the option or the file.
Camera MakeCamera(const SimulationOptions& simulation);

}  // namespace deepuav
