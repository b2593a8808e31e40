#pragma once

#include <string>

#include "deepuav/geometry/camera.h"

namespace deepuav {

/// Whether the maps of `file` may be gone on with by another camera; `whose` says whose that is,
/// `is_approximate` that it is known roughly only. Warns where pixels are seen elsewhere, since the
/// maps' camera is taken. Throws Error where they are seen so far away that it is another camera.
void CheckSameCamera(const std::string& file, const Camera& of_maps, const Camera& other,
                     const std::string& whose, bool is_approximate);

}  // namespace deepuav
