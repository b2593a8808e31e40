#include "shipped_files.h"

namespace deepuav {

namespace fs = std::filesystem;

fs::path ShippedFolder(const std::string& name) {
  std::error_code error;  // without /proc: as seen from the working folder
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  const fs::path installed = (program / ".." / "share" / "deepuav" / name).lexically_normal();
  if (fs::is_directory(installed, error)) return installed;
  return (program / DEEPUAV_SOURCE_FROM_PROGRAM / name).lexically_normal();
}

}  // namespace deepuav
