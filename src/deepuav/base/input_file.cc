#include "deepuav/base/input_file.h"

#include "deepuav/base/error.h"

namespace deepuav {

void RefuseNamedPipe(const std::filesystem::path& file) {
  std::error_code ignored;  // of a file that is not there: opening it says so
  if (!std::filesystem::is_fifo(file, ignored)) return;
  const std::string name = file.string();
  if (name.starts_with("/dev/") || name.starts_with("/proc/")) return;
  throw Error("{}: is a named pipe: expected a file", name);
}

}  // namespace deepuav
