#include "deepuav/io/geodata/grid_coordinates.h"

#include <cpl_error.h>
#include <ogr_spatialref.h>
#include <ogr_srs_api.h>

#include <array>
#include <cmath>
#include <regex>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/geodata/fix_table.h"

namespace deepuav {
namespace {

constexpr int kWgs84 = 4326;

/// What fails is told by what is returned, not printed.
struct QuietProj {
  QuietProj() { CPLPushErrorHandler(CPLQuietErrorHandler); }
  ~QuietProj() { CPLPopErrorHandler(); }
  QuietProj(const QuietProj&) = delete;
  QuietProj& operator=(const QuietProj&) = delete;
};

using System = std::unique_ptr<void, void (*)(void*)>;

System MakeSystem() {
  System system(OSRNewSpatialReference(nullptr), &OSRDestroySpatialReference);
  // x to the east and y to the north, also where the authority has it the other way about.
  OSRSetAxisMappingStrategy(system.get(), OAMS_TRADITIONAL_GIS_ORDER);
  return system;
}

/// "WGS84 UTM 32N", OpenDroneMap's own way to write it, as a code of EPSG; others as they are.
std::string AsUserInput(std::string_view system) {
  static const std::regex utm(R"(wgs ?84 ?/? utm (zone )?(\d{1,2}) ?([ns]))");
  const std::string name = LowerCase(system);
  std::smatch match;
  if (!std::regex_match(name, match, utm))
    return name == "wgs84" ? "EPSG:4326" : std::string(system);
  constexpr int kNorth = 32600, kSouth = 32700, kLastZone = 60;
  const int zone = std::stoi(match[2]);
  if (zone < 1 || zone > kLastZone) return std::string(system);
  return fmt::format("EPSG:{}", (match[3] == "n" ? kNorth : kSouth) + zone);
}

/// A list of positions may come from anyone: nothing in it has a file or an address opened.
bool SetSystem(const std::string& text, void* system) {
  const std::string name = LowerCase(text);
  constexpr std::array<std::string_view, 3> kOpenFiles = {"grids", "init=", "extension"};
  if (std::ranges::any_of(
          kOpenFiles, [&](std::string_view part) { return name.find(part) != std::string::npos; }))
    return false;
  return OGRSpatialReference::FromHandle(system)->SetFromUserInput(
             text.c_str(), OGRSpatialReference::SET_FROM_USER_INPUT_LIMITATIONS_get()) ==
         OGRERR_NONE;
}

}  // namespace

GridCoordinates::GridCoordinates(std::string_view system, const std::string& where)
    : system_(OneLine(system)), transformation_(nullptr, &OCTDestroyCoordinateTransformation) {
  const QuietProj quiet;
  const System grid = MakeSystem(), globe = MakeSystem();
  if (NamesReferenceSystem(system) && SetSystem(AsUserInput(system), grid.get()) &&
      OSRImportFromEPSG(globe.get(), kWgs84) == OGRERR_NONE)
    transformation_.reset(OCTNewCoordinateTransformation(grid.get(), globe.get()));
  if (!transformation_) {
    throw Error(
        "{}: {} is no known reference system: expected one as EPSG:4326, EPSG:25832 or "
        "WGS84 UTM 32N",
        where, Quoted(system));
  }
}

Eigen::Vector2d GridCoordinates::LatitudeLongitude(double x, double y,
                                                   const std::string& where) const {
  const QuietProj quiet;
  double longitude_deg = x, latitude_deg = y;
  if (OCTTransform(transformation_.get(), 1, &longitude_deg, &latitude_deg, nullptr) == 0 ||
      !std::isfinite(longitude_deg) || !std::isfinite(latitude_deg)) {
    throw Error("{}: {}, {} is no point of {}", where, x, y, system_);
  }
  return {latitude_deg, longitude_deg};
}

bool NamesReferenceSystem(std::string_view line) {
  const std::string name = LowerCase(line);
  constexpr std::array<std::string_view, 6> kStarts = {"epsg:",  "+proj",  "wgs84",
                                                       "wgs 84", "projcs", "geogcs"};
  return std::ranges::any_of(kStarts,
                             [&](std::string_view start) { return name.starts_with(start); });
}

}  // namespace deepuav
