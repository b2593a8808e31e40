#pragma once

#include <map>

#include "deepuav/map/atlas.h"
#include "deepuav/mapping/mapper.h"
#include "deepuav/system/sensors/georeferencing.h"

namespace deepuav {

/// Makes one of the maps that the same fixes have put on Earth, though no image shows what is in
/// two of them, where the fixes tell to `max_sigma_m` where each map's landmarks lie, in their
/// median. Their reports become that of the map that remains. Returns how many became part of
/// another.
int JoinPlacedMaps(double max_sigma_m, std::map<MapId, GeoreferenceReport>* reports, Mapper* mapper,
                   Atlas* atlas);

}  // namespace deepuav
