#include "simulated/simulation_options.h"

#include <algorithm>
#include <sstream>

#include "deepuav/assembly/settings/shipped_files.h"
#include "deepuav/base/error.h"
#include "deepuav/base/nearest_name.h"
#include "deepuav/base/option_check.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/files/options_file.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/files/yaml_map.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEnding = ".yaml";

std::vector<std::string> FlightNames() {
  std::vector<std::string> names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(ShippedFolder("flights"), error)) {
    if (entry.path().extension() == kEnding) names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

fs::path FindFlight(const std::string& name_or_file) {
  if (fs::is_regular_file(name_or_file)) return name_or_file;
  const std::vector<std::string> names = FlightNames();
  if (std::find(names.begin(), names.end(), name_or_file) != names.end())
    return ShippedFolder("flights") / (name_or_file + kEnding);
  const std::string nearest = NearestName(name_or_file, names);
  throw Error("no flight and no file '{}': expected one of {}{}", OneLine(name_or_file),
              fmt::join(names, ", "),
              nearest.empty() ? "" : fmt::format(" (the nearest is '{}')", nearest));
}

// A file that the flight's file names lies beside it.
std::string Beside(const fs::path& flight_file, const std::string& named) {
  const fs::path beside = flight_file.parent_path() / named;
  return !named.empty() && fs::is_regular_file(beside) ? beside.string() : named;
}

std::vector<double> ReadDistortion(const std::string& text) {
  std::vector<std::string_view> words;
  SplitAtBlanks(text, &words);
  std::vector<double> coefficients;
  for (const std::string_view word : words)
    coefficients.push_back(ParseFinite(word, "option camera.distortion", "a coefficient"));
  return coefficients;
}

LensModel ReadLens(const std::string& model) {
  if (model == "pinhole") return LensModel::kPinhole;
  if (model == "radial_tangential") return LensModel::kRadialTangential;
  return LensModel::kEquidistant;  // Check() lets no other pass
}

}  // namespace

void FlightOptions::Check() const { CheckOptions("flight", *this); }

void OutputOptions::Check() const { CheckOptions("output", *this); }

void CameraOptions::Check() const { CheckOptions("camera", *this); }

Camera MakeCamera(const SimulationOptions& simulation) {
  const CameraOptions& options = simulation.camera;
  options.Check();
  Camera camera;
  if (!options.file.empty()) {
    camera = ReadCompleteCameraFile(options.file).camera;
  } else {
    camera.width = options.width;
    camera.height = options.height;
    camera.pinhole = {options.fx, options.fy, options.cx, options.cy};
    camera.lens = ReadLens(options.model);
    if (camera.lens != LensModel::kPinhole) camera.distortion = ReadDistortion(options.distortion);
    CheckDistortionCount(camera.lens, camera.distortion.size(), "option camera.distortion",
                         "distortion");
  }
  camera.rate_hz = options.rate_hz;
  camera.readout_s = simulation.sensor.rolling_shutter_readout_s;
  camera.Check("the flight's camera");
  return camera;
}

void SimulationOptions::Check() const {
  flight.Check();
  course.Check();
  attitude.Check();
  wind.Check();
  mount.Check();
  sensor.Check();
  weather.Check();
  scene.Check();
  imu.Check();
  gnss.Check();
  barometer.Check();
  output.Check();
  MakeCamera(*this);
}

void SimulationOptions::Register(OptionRegistry* registry) {
  registry->Add("flight", &flight);
  registry->Add("course", &course);
  registry->Add("attitude", &attitude);
  registry->Add("wind", &wind);
  registry->Add("camera", &camera);
  registry->Add("mount", &mount);
  registry->Add("sensor", &sensor);
  registry->Add("weather", &weather);
  registry->Add("scene", &scene);
  registry->Add("imu", &imu);
  registry->Add("gnss", &gnss);
  registry->Add("barometer", &barometer);
  registry->Add("output", &output);
}

void LoadSimulation(const SimulationChoice& choice, SimulationOptions* options,
                    OptionRegistry* registry) {
  const fs::path file = FindFlight(choice.flight);
  const auto apply = [&] {
    LoadOptionsFile(file, registry);
    for (const std::string& assignment : choice.assignments) registry->SetAssignment(assignment);
    if (!choice.scene.empty()) options->flight.scene = choice.scene;
  };
  apply();
  // Now that the scene is known, what is said about it goes on top of it.
  options->scene =
      LoadScene(choice.scene.empty() ? Beside(file, options->flight.scene) : options->flight.scene);
  apply();
  options->camera.file = Beside(file, options->camera.file);
  options->Check();
}

std::vector<ListedFlight> ListFlights() {
  std::vector<ListedFlight> flights;
  for (const std::string& name : FlightNames()) {
    const YamlMap yaml = YamlMap::Read(ShippedFolder("flights") / (name + kEnding));
    flights.push_back({name, yaml.Map("flight").Text("about")});
  }
  return flights;
}

}  // namespace deepuav
