#include "deepuav/simulation/scene_options.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>

#include "deepuav/base/error.h"
#include "deepuav/base/nearest_name.h"
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

SceneOptions HallScene() {
  SceneOptions scene;
  scene.kind = "hall";
  scene.extent_m = 40;
  return scene;
}

const std::map<std::string, std::function<SceneOptions()>>& Scenes() {
  static const std::map<std::string, std::function<SceneOptions()>> scenes = {
      {"village", Village}, {"countryside", Countryside}, {"town", Town},      {"forest", Forest},
      {"desert", Desert},   {"highway", Highway},         {"hall", HallScene},
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

void SceneOptions::Check() const {
  if (kind != "outdoor" && kind != "hall") {
    throw Error("scene.kind is '{}': expected outdoor or hall", kind);
  }
  const auto positive = [](double value, const char* name) {
    CheckOption(value > 0, name, value, "a positive number");
  };
  const auto share = [](double value, const char* name) {
    CheckOption(value >= 0 && value <= 1, name, value, "0 to 1");
  };
  const auto not_negative = [](double value, const char* name) {
    CheckOption(value >= 0, name, value, "0 or more");
  };
  CheckOption(extent_m >= 16 && extent_m <= 8000, "scene.extent_m", extent_m, "16 to 8000");
  CheckOption(terrain_cell_m > 0 && extent_m / terrain_cell_m <= 4000, "scene.terrain_cell_m",
              terrain_cell_m, "a positive size, of which at most 4000 make the extent");
  not_negative(relief_m, "scene.relief_m");
  positive(relief_length_m, "scene.relief_length_m");
  CheckOption(parcel_m >= 20, "scene.parcel_m", parcel_m, "at least 20");
  not_negative(town_radius_m, "scene.town_radius_m");
  share(building_fraction, "scene.building_fraction");
  CheckOption(storeys >= 1 && storeys <= 40, "scene.storeys", storeys, "1 to 40");
  share(flat_roof_fraction, "scene.flat_roof_fraction");
  share(tree_fraction, "scene.tree_fraction");
  share(forest_fraction, "scene.forest_fraction");
  share(aridity, "scene.aridity");
  not_negative(river_width_m, "scene.river_width_m");
  not_negative(lake_radius_m, "scene.lake_radius_m");
  not_negative(cars_per_km, "scene.cars_per_km");
  not_negative(people_per_km, "scene.people_per_km");
  positive(orthophoto_cell_m, "scene.orthophoto_cell_m");
  positive(dem_cell_m, "scene.dem_cell_m");
  positive(dem_unit_m, "scene.dem_unit_m");
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
