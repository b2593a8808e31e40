#pragma once

#include <optional>
#include <string>

#include "deepuav/assembly/networks/eyes.h"
#include "deepuav/assembly/settings/run_options.h"
#include "deepuav/io/maps/map_file.h"

namespace deepuav {

/// The maps of an earlier run, to be gone on with: by images of `camera`, which is known roughly
/// only where `is_approximate`. Throws Error where the images were not taken with the maps' camera.
LoadedAtlas LoadMaps(const std::string& file, const Camera& camera, bool is_approximate);

/// At how many pixels the network saw what the maps were made of last, where that is fewer than the
/// options would have it see of images in order.
std::optional<double> PixelsSeenBefore(const MapOrigin& origin, const SuperPointOptions& options);

/// Throws Error where descriptors cannot be compared, warns where they may differ.
void CheckNetwork(const std::string& file, const LoadedAtlas& loaded, const Eyes& eyes);

/// Of maps that grow: all that made them. Maps that only localise stay as they are.
MapOrigin OriginOf(const std::optional<LoadedAtlas>& loaded, const Eyes& eyes, bool localise_only);

}  // namespace deepuav
