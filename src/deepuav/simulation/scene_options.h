#pragma once

#include <string>
#include <vector>

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

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("kind", kind, "", "outdoor or hall");
    visit("seed", seed, "", "seed of everything that is placed by chance");
    visit("extent_m", extent_m, "m", "side of the square terrain, or length of the hall");
    visit("terrain_cell_m", terrain_cell_m, "m", "spacing of the terrain's height samples");
    visit("relief_m", relief_m, "m", "height between valleys and hills");
    visit("relief_length_m", relief_length_m, "m", "horizontal size of the largest hills");
    visit("parcel_m", parcel_m, "m", "typical side of a field or block of houses");
    visit("town_radius_m", town_radius_m, "m", "houses stand within this of the middle");
    visit("building_fraction", building_fraction, "", "share of the plots in town built on");
    visit("storeys", storeys, "", "mean number of storeys");
    visit("flat_roof_fraction", flat_roof_fraction, "", "share of flat roofs");
    visit("tree_fraction", tree_fraction, "", "share of the sites of single trees in use");
    visit("forest_fraction", forest_fraction, "", "share of the parcels that are forest");
    visit("aridity", aridity, "", "0 green to 1 desert");
    visit("river_width_m", river_width_m, "m", "width of the river, 0 for none");
    visit("lake_radius_m", lake_radius_m, "m", "radius of the lake, 0 for none");
    visit("cars_per_km", cars_per_km, "1/km", "cars on each kilometre of road");
    visit("people_per_km", people_per_km, "1/km", "people on each kilometre of road");
    visit("lorry_fraction", lorry_fraction, "", "share of cars made lorries, beside one in seven");
    visit("traffic_speed_factor", traffic_speed_factor, "", "of cars, lorries and people");
    visit("traffic_stop_s", traffic_stop_s, "s", "when all traffic has stopped for a while");
    visit("traffic_stands_s", traffic_stands_s, "s", "how long it stands then, 0 for never");
    visit("orthophoto", orthophoto, "", "image file laid over the terrain");
    visit("orthophoto_cell_m", orthophoto_cell_m, "m", "ground size of its pixels");
    visit("dem", dem, "", "image file of terrain heights");
    visit("dem_cell_m", dem_cell_m, "m", "ground size of its pixels");
    visit("dem_unit_m", dem_unit_m, "m", "height of one grey level");
  }
};

/// The scenes known by name: village, countryside, town, forest, desert, hall, highway.
std::vector<std::string> SceneNames();

/// A scene by name, or from a YAML file: a map of the options above, and `base: NAME` for the scene
/// whose values hold for the rest (default village). File names in it are relative to the YAML
/// file. Throws Error for a name that is neither, and for unknown keys and values out of range.
SceneOptions LoadScene(const std::string& name_or_file);

}  // namespace deepuav
