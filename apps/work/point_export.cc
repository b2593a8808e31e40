#include "work/point_export.h"

#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/io/maps/las_file.h"
#include "deepuav/io/maps/map_export.h"
#include "deepuav/io/maps/point_cloud.h"
#include "deepuav/ortho/landmark_colours.h"
#include "deepuav/ortho/view_images.h"

namespace deepuav {
namespace {

void SayGrey(const std::string& which, const std::string& why) {
  std::cout << fmt::format("{} are grey: {}\n", which, why);
}

/// Null where the images are not to be had, or are not of this map.
std::unique_ptr<Photographs> FindPhotographs(const LoadedAtlas& loaded, MapId map,
                                             const RunImages& images) {
  bool is_open = false;
  try {
    auto dataset = images.Open();
    is_open = true;
    return PhotographsOf(ViewImagesOf(loaded, map), std::move(dataset));
  } catch (const Error& error) {
    if (!images.named.empty() && !is_open) throw;
    SayGrey("points", error.what());
    return nullptr;
  }
}

std::vector<ColouredPoint> PointsOf(const LoadedAtlas& loaded, MapId id, const RunImages& images) {
  const Map& map = loaded.atlas.At(id);
  std::vector<ColouredPoint> points = LandmarkPoints(map);
  const auto photographs = FindPhotographs(loaded, id, images);
  if (!photographs) return points;
  std::vector<std::string> unreadable;
  ColourPoints(
      map, loaded.camera, photographs.get(),
      [&unreadable](const std::string& why) { unreadable.push_back(why); }, &points);
  if (!unreadable.empty())
    SayGrey(fmt::format("points of {} images", unreadable.size()), unreadable.front());
  return points;
}

}  // namespace

void ExportPly(const std::filesystem::path& out, const LoadedAtlas& loaded, MapId map,
               const RunImages& images) {
  WritePly(out, PointsOf(loaded, map, images));
}

void ExportLas(const std::filesystem::path& out, const LoadedAtlas& loaded, MapId map,
               const RunImages& images) {
  std::vector<ColouredPoint> points = PointsOf(loaded, map, images);
  const Gauge gauge = loaded.atlas.GaugeOf(map);
  if (gauge.kind != GaugeKind::kGeoreferenced) return WriteLas(out, points);
  const UtmZone zone = UtmZoneOf(gauge.origin);
  MoveIntoUtm(gauge.origin, zone, &points);
  WriteLas(out, points, zone.Epsg());
}

}  // namespace deepuav
