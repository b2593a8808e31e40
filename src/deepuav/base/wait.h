#pragma once

#include <functional>

namespace deepuav {

/// Waits so long, or until `stop` (may be empty) says true.
void WaitUnless(const std::function<bool()>& stop, double seconds);

}  // namespace deepuav
