#include "deepuav/assembly/settings/shipped_files.h"

#include <dlfcn.h>
#include <link.h>

namespace deepuav {
namespace {

namespace fs = std::filesystem;

/// The folder of the program or the shared library that holds this code.
fs::path OwnFolder() {
  std::error_code error;  // without /proc: as seen from the working folder
  Dl_info info{};
  link_map* loaded = nullptr;
  const bool is_found = dladdr1(reinterpret_cast<void*>(&OwnFolder), &info,
                                reinterpret_cast<void**>(&loaded), RTLD_DL_LINKMAP) != 0;
  // Of the program itself the name is empty.
  if (is_found && loaded && loaded->l_name && *loaded->l_name)
    return fs::weakly_canonical(loaded->l_name, error).parent_path();
  return fs::read_symlink("/proc/self/exe", error).parent_path();
}

}  // namespace

fs::path ShippedFolder(const std::string& name) {
  static const fs::path own = OwnFolder();
  std::error_code error;
  // PREFIX/bin, PREFIX/lib; PREFIX/lib/x86_64-linux-gnu.
  for (const char* prefix : {"..", "../.."}) {
    fs::path installed = (own / prefix / "share" / "deepuav" / name).lexically_normal();
    if (fs::is_directory(installed, error)) return installed;
  }
  return (own / DEEPUAV_SOURCE_FROM_BUILD / name).lexically_normal();
}

}  // namespace deepuav
