#pragma once

#include <vector>

#include "deepuav/map/map.h"
#include "deepuav/map/requests.h"

namespace deepuav {

/// Gives keyframes other poses and other observations: landmarks that nothing else saw than they
/// did from where they are not are removed.
void Relocate(const std::vector<KeyframeRelocation>& relocations, Map* map);

}  // namespace deepuav
