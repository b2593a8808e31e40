#pragma once

#include <span>
#include <string>

#include "deepuav/geometry/se3.h"

namespace deepuav {

/// The transform [R | t] of 12 numbers by rows. Throws Error ("where: field ...") unless R is a
/// rotation, within the digits that such files carry.
SE3 RigidFromRows(std::span<const double, 12> rows, const std::string& where,
                  const std::string& field);

}  // namespace deepuav
