#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "deepuav/geometry/camera.h"

namespace deepuav {

/// As files call it.
std::string NameOf(LensModel lens);

/// By that name or one that other programs have for it; nothing for a name of none.
std::optional<LensModel> LensModelOf(std::string_view name);

std::vector<std::string> LensModelNames();

}  // namespace deepuav
