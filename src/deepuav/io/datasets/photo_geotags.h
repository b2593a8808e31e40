#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/sensors/samples.h"

namespace deepuav {

/// What a table says of where photographs were taken.
struct PhotoGeotags {
  std::filesystem::path file;                 ///< Empty: there is none that names any of them.
  std::vector<std::optional<GnssFix>> fixes;  ///< As many as photographs.
};

/// From the first table of positions (ReadGeotagFile) in one of `folders` that names any of them.
/// Photographs are found by their path below `images`, else by name, else by name without ending,
/// in upper or lower case; a name that several have is none, and where two rows name one equally
/// well it has no position. Warns of tables that cannot be read or name none.
PhotoGeotags FindPhotoGeotags(const std::vector<std::filesystem::path>& folders,
                              const std::filesystem::path& images,
                              const std::vector<std::filesystem::path>& photographs);

}  // namespace deepuav
