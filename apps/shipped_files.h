#pragma once

#include <filesystem>
#include <string>

namespace deepuav {

/// A folder that comes with the program ("models", "flights"): that of the installation which the
/// program lies in (PREFIX/bin and PREFIX/share/deepuav), else that of the source tree from which
/// it was built, found from where the program lies.
std::filesystem::path ShippedFolder(const std::string& name);

}  // namespace deepuav
