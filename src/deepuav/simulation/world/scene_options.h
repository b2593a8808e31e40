#pragma once

#include <string>
#include <vector>

#include "deepuav/base/option_bounds.h"

namespace deepuav {

/// What a world is made of. Everything follows from these values and the seed.
struct SceneOptions {
  std::string kind = "outdoor";  ///< outdoor | hall
  int seed = 1;
  double extent_m = 1200;  ///< Side of the square terrain.
  double terrain_cell_m = 4;
  double relief_m = 25;            ///< Height between valleys and hills.
  double relief_length_m = 450;    ///< Horizontal size of the largest hills.
  double parcel_m = 110;           ///< Typical side of a field or of a block of houses.
  double town_radius_m = 160;      ///< Houses stand within this of the middle.
  double building_fraction = 0.8;  ///< Share of the plots in town that are built on.
  double storeys = 2;              ///< Mean number of storeys.
  double flat_roof_fraction = 0.15;
  double tree_fraction = 0.35;   ///< Share of the tree sites near houses, hedges and roads in use.
  double forest_fraction = 0.2;  ///< Share of the parcels that are forest.
  double aridity = 0;            ///< 0 green to 1 desert.
  double river_width_m = 18;     ///< 0: none.
  double lake_radius_m = 70;     ///< 0: none.
  double solar_panels_m = 0;     ///< Side of a square of rows of solar panels; 0: none.
  double cars_per_km = 12;
  double people_per_km = 8;
  double lorry_fraction = 0;        ///< Share of the cars made lorries, beside one in seven.
  double traffic_speed_factor = 1;  ///< Of cars, lorries and people.
  double traffic_stop_s = 0;        ///< When all traffic has stopped for a while.
  double traffic_stands_s = 0;      ///< How long it stands then; 0: it never stops.
  std::string orthophoto;           ///< Image file laid over the terrain; "" : procedural.
  double orthophoto_cell_m = 0.2;
  std::string dem;  ///< Image file (8 or 16 bit, or float) of heights; "" : procedural.
  double dem_cell_m = 5;
  double dem_unit_m = 1;  ///< Height of one grey level.

  void Check() const;
  /// Throws OptionError where two options contradict each other.
  void CheckRelations() const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    constexpr double kFarthestM = 8000;
    visit("kind", kind, "", "what the world is", OneOf({"outdoor", "hall"}));
    visit("seed", seed, "", "seed of everything that is placed by chance", AnySeed());
    visit("extent_m", extent_m, "m", "side of the square terrain, or length of the hall",
          Between(16, kFarthestM));
    visit("terrain_cell_m", terrain_cell_m, "m", "spacing of the terrain's height samples",
          Above(0, kFarthestM));
    visit("relief_m", relief_m, "m", "height between valleys and hills", Between(0, 2000));
    visit("relief_length_m", relief_length_m, "m", "horizontal size of the largest hills",
          Between(1, 100'000));
    visit("parcel_m", parcel_m, "m", "typical side of a field or block of houses",
          Between(20, kFarthestM));
    visit("town_radius_m", town_radius_m, "m", "houses stand within this of the middle",
          Between(0, kFarthestM));
    visit("building_fraction", building_fraction, "", "share of the plots in town built on",
          Between(0, 1));
    visit("storeys", storeys, "", "mean number of storeys", Between(1, 40));
    visit("flat_roof_fraction", flat_roof_fraction, "", "share of flat roofs", Between(0, 1));
    visit("tree_fraction", tree_fraction, "", "share of the sites of single trees in use",
          Between(0, 1));
    visit("forest_fraction", forest_fraction, "", "share of the parcels that are forest",
          Between(0, 1));
    visit("aridity", aridity, "", "0 green to 1 desert", Between(0, 1));
    visit("river_width_m", river_width_m, "m", "width of the river, 0 for none", Between(0, 1000));
    visit("lake_radius_m", lake_radius_m, "m", "radius of the lake, 0 for none",
          Between(0, kFarthestM));
    visit("solar_panels_m", solar_panels_m, "m",
          "side of a square of rows of solar panels in the middle, 0 for none",
          Between(0, kFarthestM));
    visit("cars_per_km", cars_per_km, "1/km", "cars on each kilometre of road", Between(0, 1000));
    visit("people_per_km", people_per_km, "1/km", "people on each kilometre of road",
          Between(0, 1000));
    visit("lorry_fraction", lorry_fraction, "", "share of cars made lorries, beside one in seven",
          Between(0, 1));
    visit("traffic_speed_factor", traffic_speed_factor, "", "of cars, lorries and people",
          Between(0, 10));
    visit("traffic_stop_s", traffic_stop_s, "s", "when all traffic has stopped for a while",
          Between(-100'000, 100'000));
    visit("traffic_stands_s", traffic_stands_s, "s", "how long it stands then, 0 for never",
          Between(0, 100'000));
    visit("orthophoto", orthophoto, "", "image file laid over the terrain");
    visit("orthophoto_cell_m", orthophoto_cell_m, "m", "ground size of its pixels",
          Between(0.001, 1000));
    visit("dem", dem, "", "image file of terrain heights");
    visit("dem_cell_m", dem_cell_m, "m", "ground size of its pixels", Between(0.001, 1000));
    visit("dem_unit_m", dem_unit_m, "m", "height of one grey level", Between(1e-6, 1000));
  }
};

/// The scenes known by name: village, countryside, town, forest, desert, solar, highway, hall.
std::vector<std::string> SceneNames();

/// A scene by name, or from a YAML file: a map of the options above, and `base: NAME` for the scene
/// whose values hold for the rest (default village). File names in it are relative to the YAML
/// file. Throws Error for a name that is neither, and for unknown keys and values out of range.
SceneOptions LoadScene(const std::string& name_or_file);

}  // namespace deepuav
