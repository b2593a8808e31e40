#pragma once

#include <string>

#include "deepuav/io/maps/map_file.h"

namespace deepuav {

/// What `deepuav map info` prints: a few lines for a person.
std::string MapFileText(const std::string& file, const LoadedAtlas& loaded,
                        const MapFileFacts& facts);

/// The same as JSON, with all digits.
std::string MapFileJson(const std::string& file, const LoadedAtlas& loaded,
                        const MapFileFacts& facts);

}  // namespace deepuav
