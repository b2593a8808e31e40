#include "deepuav/assembly/maps/loaded_maps.h"

#include <regex>

#include "deepuav/assembly/settings/camera_checks.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

/// Of the maps' descriptors; nothing where there are none.
std::optional<int> DimensionOf(const Atlas& atlas) {
  std::optional<int> dimension;
  for (const MapId map : atlas.Remaining()) {
    atlas.At(map).keyframes().ForEach(
        [&](const Keyframe& keyframe) { dimension = keyframe.features().descriptors.dimension(); });
  }
  return dimension;
}

}  // namespace

LoadedAtlas LoadMaps(const std::string& file, const Camera& camera, bool is_approximate) {
  LoadedAtlas loaded = ReadMapFile(file);
  const Camera& there = loaded.camera;
  if (camera.width != there.width || camera.height != there.height) {
    throw Error("{}: its camera has {} x {} px: expected {} x {} as the images", file, there.width,
                there.height, camera.width, camera.height);
  }
  loaded.camera.readout_s = camera.readout_s;
  CheckSameCamera(file, there, camera, "the dataset's", is_approximate);
  return loaded;
}

std::optional<double> PixelsSeenBefore(const MapOrigin& origin, const SuperPointOptions& options) {
  constexpr double kSame = 0.9;  // Of pixels: sides are whole cells of the network.
  static const std::regex at_size(" at ([0-9]{1,5})x([0-9]{1,5})$");
  std::smatch found;
  if (!std::regex_search(origin.features, found, at_size)) return std::nullopt;
  const double pixels = std::stod(found[1]) * std::stod(found[2]);
  const bool is_fewer = options.network_pixels == 0 || pixels < kSame * options.network_pixels;
  return is_fewer ? std::optional(pixels) : std::nullopt;
}

void CheckNetwork(const std::string& file, const LoadedAtlas& loaded, const Eyes& eyes) {
  const MapOrigin& origin = loaded.origin;
  const int wanted = eyes.extractor().dimension(),
            held = DimensionOf(loaded.atlas).value_or(wanted);
  if (held != wanted) {
    throw Error("{}: holds descriptors of dimension {}: expected {} as {} gives", file, held,
                wanted, eyes.extractor().Description());
  }
  if (origin.features == eyes.extractor().Description()) return;
  Log().warn("{}: made with {}, continued with {}: places may not be recognised", file,
             origin.features, eyes.extractor().Description());
}

MapOrigin OriginOf(const std::optional<LoadedAtlas>& loaded, const Eyes& eyes, bool localise_only) {
  if (loaded && localise_only) return loaded->origin;
  const std::string now = eyes.extractor().Description();
  MapOrigin origin{DEEPUAV_VERSION, now, eyes.matcher().Description(), {}};
  if (!loaded) return origin;
  const std::string& before = loaded->origin.features;
  if (before != now)
    origin.features = before.find(now) == std::string::npos ? before + "; " + now : before;
  origin.image_names = loaded->origin.image_names;
  return origin;
}

}  // namespace deepuav
