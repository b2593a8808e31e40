#include <array>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arguments/argument_checks.h"
#include "commands/commands.h"
#include "commands/map_merge_command.h"
#include "deepuav/base/error.h"
#include "deepuav/io/cameras/camera_table.h"
#include "deepuav/io/geodata/geo_trajectory.h"
#include "deepuav/io/geodata/trajectory.h"
#include "deepuav/io/maps/colmap_model.h"
#include "deepuav/io/maps/map_export.h"
#include "deepuav/io/maps/map_file.h"
#include "work/map_description.h"
#include "work/point_export.h"
#include "work/raster_export.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

struct InfoArguments {
  std::string file;
  bool json = false;
};

void Info(const InfoArguments& arguments) {
  MapFileFacts facts;
  const LoadedAtlas loaded = ReadMapFile(arguments.file, &facts);
  std::cout << (arguments.json ? MapFileJson(arguments.file, loaded, facts)
                               : MapFileText(arguments.file, loaded, facts));
}

struct ExportArguments {
  std::string file, format;
  fs::path out;
  std::optional<int> map;
  RunImages images;
  RasterArguments raster;
};

/// One kind of file or folder that a map can become.
struct ExportFormat {
  const char* name;
  void (*write)(const fs::path& out, const Map& map, const LoadedAtlas& loaded,
                const ExportArguments& arguments);
};

/// The keyframes' path on Earth. Throws Error where the map has no place there.
template <typename Write>
void WriteOnEarth(const fs::path& out, const Map& map, const LoadedAtlas& loaded, Write write) {
  const Gauge gauge = loaded.atlas.GaugeOf(map.id());
  if (gauge.kind != GaugeKind::kGeoreferenced) {
    throw Error("map {}: has no place on Earth: expected one that was made with position fixes",
                map.id().value);
  }
  write(out, gauge.origin, KeyframeTrajectory(map));
}

constexpr std::array<ExportFormat, 10> kFormats = {{
    {"ply",
     [](const fs::path& out, const Map& map, const LoadedAtlas& loaded,
        const ExportArguments& arguments) { ExportPly(out, loaded, map.id(), arguments.images); }},
    {"las",
     [](const fs::path& out, const Map& map, const LoadedAtlas& loaded,
        const ExportArguments& arguments) { ExportLas(out, loaded, map.id(), arguments.images); }},
    {"colmap",
     [](const fs::path& out, const Map& map, const LoadedAtlas& loaded, const ExportArguments&) {
       WriteColmapModel(out, map, loaded.camera, loaded.origin.image_names);
     }},
    {"tum", [](const fs::path& out, const Map& map, const LoadedAtlas&,
               const ExportArguments&) { WriteTrajectory(out, KeyframeTrajectory(map)); }},
    {"geojson", [](const fs::path& out, const Map& map, const LoadedAtlas& loaded,
                   const ExportArguments&) { WriteOnEarth(out, map, loaded, WriteGeoJson); }},
    {"kml", [](const fs::path& out, const Map& map, const LoadedAtlas& loaded,
               const ExportArguments&) { WriteOnEarth(out, map, loaded, WriteKml); }},
    {"gpx", [](const fs::path& out, const Map& map, const LoadedAtlas& loaded,
               const ExportArguments&) { WriteOnEarth(out, map, loaded, WriteGpx); }},
    {"csv",
     [](const fs::path& out, const Map& map, const LoadedAtlas& loaded, const ExportArguments&) {
       const Gauge gauge = loaded.atlas.GaugeOf(map.id());
       const bool on_earth = gauge.kind == GaugeKind::kGeoreferenced;
       WriteCameraTable(out, map, loaded.origin.image_names,
                        on_earth ? std::optional(gauge.origin) : std::nullopt);
     }},
    {"orthophoto",
     [](const fs::path& out, const Map& map, const LoadedAtlas& loaded,
        const ExportArguments& arguments) {
       ExportOrthophoto(out, loaded, map.id(), arguments.images, arguments.raster);
     }},
    {"dsm",
     [](const fs::path& out, const Map& map, const LoadedAtlas& loaded,
        const ExportArguments& arguments) { ExportDsm(out, loaded, map.id(), arguments.raster); }},
}};

std::vector<std::string> FormatNames() {
  std::vector<std::string> names;
  for (const ExportFormat& format : kFormats) names.emplace_back(format.name);
  return names;
}

const ExportFormat& FormatNamed(const std::string& name) {
  for (const ExportFormat& format : kFormats) {
    if (name == format.name) return format;
  }
  throw Error("format '{}': expected one of those that --help lists", name);
}

/// The maps to export. Throws Error where there is none.
std::vector<MapId> ChosenMaps(const ExportArguments& arguments, const Atlas& atlas) {
  std::vector<MapId> maps;
  for (const MapId id : atlas.Remaining()) {
    const bool is_chosen = !arguments.map || id.value == *arguments.map;
    if (is_chosen && atlas.At(id).KeyframeCount() > 0) maps.push_back(id);
  }
  if (!maps.empty()) return maps;
  if (!arguments.map) throw Error("{}: holds no keyframe", arguments.file);
  throw Error("{}: has no map {} with keyframes: expected 0 to {}", arguments.file, *arguments.map,
              static_cast<int>(atlas.Remaining().size()) - 1);
}

/// "points.ply" becomes "points-map-2.ply".
fs::path PathOfMap(const fs::path& out, MapId map) {
  fs::path path = out.has_filename() ? out : out.parent_path();
  const fs::path ending = path.extension();
  path.replace_extension();
  path += fmt::format("-map-{}", map.value);
  path += ending;
  return path;
}

void Export(const ExportArguments& arguments) {
  const ExportFormat& format = FormatNamed(arguments.format);
  RefuseInputAsOutput(arguments.out, {arguments.file});
  const LoadedAtlas loaded = ReadMapFile(arguments.file);
  const std::vector<MapId> maps = ChosenMaps(arguments, loaded.atlas);
  for (const MapId id : maps) {
    const Map& map = loaded.atlas.At(id);
    const fs::path out = maps.size() == 1 ? arguments.out : PathOfMap(arguments.out, id);
    RefuseInputAsOutput(out, {arguments.file});
    format.write(out, map, loaded, arguments);
    std::cout << fmt::format("{}: map {}, {} keyframes, {} landmarks\n", out.string(), id.value,
                             map.KeyframeCount(), map.LandmarkCount());
  }
}

void AddInfoCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("info", "What a map file holds");
  const auto arguments = std::make_shared<InfoArguments>();
  command->add_option("FILE", arguments->file, "A map.deepuav")->required();
  command->add_flag("--json", arguments->json, "As JSON");
  command->footer("Example:\n  deepuav map info out/map.deepuav");
  command->callback([arguments] { Info(*arguments); });
}

void AddExportCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("export", "Write maps in a format of other programs");
  const auto arguments = std::make_shared<ExportArguments>();
  command->add_option("FILE", arguments->file, "A map.deepuav")->required();
  command
      ->add_option("--format", arguments->format,
                   "ply, las: landmarks, coloured; colmap: a text model; tum, geojson, kml, gpx: "
                   "path of the "
                   "keyframes; csv: their poses and images; orthophoto, dsm: the ground as GeoTIFF")
      ->required()
      ->check(CLI::IsMember(FormatNames()));
  command
      ->add_option("--out", arguments->out,
                   "File, or folder for colmap; with several maps -map-N is put into its name")
      ->required()
      ->check(NamedOutput());
  command->add_option("--map", arguments->map, "Only this map; all by default")
      ->check(CLI::Range(0, std::numeric_limits<int>::max()).description(""));
  AddImagesArgument(*command, arguments->images);
  AddRasterArguments(*command, arguments->raster);
  command->footer(
      "Examples:\n"
      "  deepuav map export out/map.deepuav --format las --out points.las\n"
      "  deepuav map export out/map.deepuav --format orthophoto --out ortho.tif --resolution 0.05\n"
      "  deepuav map export out/map.deepuav --format colmap --out sparse --map 0");
  command->callback([arguments] {
    arguments->images.map_file = arguments->file;
    Export(*arguments);
  });
}

}  // namespace

void AddMapCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("map", "Inspect, merge and export saved maps");
  command->require_subcommand(1);
  AddInfoCommand(*command);
  AddExportCommand(*command);
  AddMergeCommand(*command);
}

}  // namespace deepuav
