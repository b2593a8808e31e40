#pragma once

#include "deepuav/map/atlas.h"

namespace deepuav {

/// Takes the maps of `other` into `atlas` under new ids, so that nothing is called the same.
/// Returns the ids that the keyframes got, by those they had. The maps stay apart.
std::map<KeyframeId, KeyframeId> TakeMaps(const Atlas& other, Atlas* atlas);

}  // namespace deepuav
