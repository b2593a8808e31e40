#pragma once

#include <filesystem>
#include <string>

namespace deepuav {

/// A folder that comes with the program and the library ("models", "flights"): that of the
/// installation which the one that runs this lies in (PREFIX/bin or PREFIX/lib beside
/// PREFIX/share/deepuav), else that of the source tree from which it was built, found from where
/// it lies.
std::filesystem::path ShippedFolder(const std::string& name);

}  // namespace deepuav
