#include "deepuav/simulation/world/scene_options.h"

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <functional>
#include <map>

#include "deepuav/base/error.h"
#include "deepuav/base/nearest_name.h"
#include "deepuav/base/option_check.h"
#include "deepuav/base/options.h"

namespace deepuav {
namespace {

SceneOptions Village() { return {}; }

SceneOptions Countryside() {
  SceneOptions scene;
  scene.town_radius_m = 0;
  scene.relief_m = 40;
  scene.forest_fraction = 0.22;
  scene.cars_per_km = 5;
  scene.people_per_km = 1;
  return scene;
}

SceneOptions Town() {
  SceneOptions scene;
  scene.town_radius_m = 330;
  scene.storeys = 5;
  scene.flat_roof_fraction = 0.55;
  scene.relief_m = 12;
  scene.cars_per_km = 30;
  scene.people_per_km = 25;
  scene.building_fraction = 0.92;
  return scene;
}

SceneOptions Forest() {
  SceneOptions scene;
  scene.town_radius_m = 0;
  scene.forest_fraction = 0.7;
  scene.relief_m = 60;
  scene.cars_per_km = 2;
  scene.people_per_km = 2;
  return scene;
}

SceneOptions Desert() {
  SceneOptions scene;
  scene.aridity = 1;
  scene.town_radius_m = 60;
  scene.forest_fraction = 0;
  scene.tree_fraction = 0.1;
  scene.river_width_m = 0;
  scene.lake_radius_m = 0;
  scene.relief_m = 45;
  scene.cars_per_km = 3;
  scene.people_per_km = 1;
  return scene;
}

SceneOptions Highway() {
  SceneOptions scene;
  scene.town_radius_m = 0;
  scene.relief_m = 8;
  scene.tree_fraction = 0.1;
  scene.forest_fraction = 0.05;
  scene.cars_per_km = 110;
  scene.people_per_km = 0;
  return scene;
}

SceneOptions Solar() {
  SceneOptions scene;
  scene.town_radius_m = 0;
  scene.relief_m = 12;
  scene.tree_fraction = 0.1;
  scene.forest_fraction = 0.05;
  scene.river_width_m = 0;
  scene.lake_radius_m = 0;
  scene.solar_panels_m = 400;
  scene.cars_per_km = 1;
  scene.people_per_km = 1;
  return scene;
}

SceneOptions HallScene() {
  SceneOptions scene;
  scene.kind = "hall";
  scene.extent_m = 40;
  return scene;
}

const std::map<std::string, std::function<SceneOptions()>>& Scenes() {
  static const std::map<std::string, std::function<SceneOptions()>> scenes = {
      {"village", Village}, {"countryside", Countryside}, {"town", Town},      {"forest", Forest},
      {"desert", Desert},   {"highway", Highway},         {"hall", HallScene}, {"solar", Solar},
  };
  return scenes;
}

SceneOptions SceneByName(const std::string& name) {
  const auto scene = Scenes().find(name);
  if (scene == Scenes().end()) {
    throw Error("scene '{}' is neither a known name nor a file: did you mean '{}'?", name,
                NearestName(name, SceneNames()));
  }
  return scene->second();
}

void MakeRelativeTo(const std::filesystem::path& folder, std::string* file) {
  if (!file->empty()) *file = (folder / *file).string();
}

SceneOptions LoadSceneFile(const std::string& file) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(file);
  } catch (const YAML::Exception& error) {
    throw Error("{}: is no YAML: {}", file, error.what());
  }
  if (!root.IsMap()) throw Error("{}: holds no map of scene options", file);
  SceneOptions scene = SceneByName(root["base"] ? root["base"].as<std::string>("") : "village");
  OptionRegistry registry;
  registry.Add("scene", &scene);
  for (const auto& entry : root) {
    const auto key = entry.first.as<std::string>("");
    if (key == "base") continue;
    if (!entry.second.IsScalar()) throw Error("{}: {} is no single value", file, key);
    try {
      registry.Set("scene." + key, entry.second.Scalar());
    } catch (const Error& error) {
      throw Error("{}: {}", file, error.what());
    }
  }
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  MakeRelativeTo(folder, &scene.orthophoto);
  MakeRelativeTo(folder, &scene.dem);
  return scene;
}

}  // namespace

void SceneOptions::Check() const { CheckOptions("scene", *this); }

void SceneOptions::CheckRelations() const {
  constexpr double kMostCells = 4000;
  CheckOption(terrain_cell_m <= extent_m && extent_m / terrain_cell_m <= kMostCells,
              "terrain_cell_m", terrain_cell_m, "a size of which 1 to 4000 make scene.extent_m");
}

std::vector<std::string> SceneNames() {
  std::vector<std::string> names;
  for (const auto& [name, scene] : Scenes()) names.push_back(name);
  return names;
}

SceneOptions LoadScene(const std::string& name_or_file) {
  const SceneOptions scene = std::filesystem::is_regular_file(name_or_file)
                                 ? LoadSceneFile(name_or_file)
                                 : SceneByName(name_or_file);
  scene.Check();
  return scene;
}

}  // namespace deepuav
