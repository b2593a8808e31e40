#include "deepuav/base/temporary_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

/// Null, and errno, where there is none.
std::FILE* OpenNamelessFile() {
  const char* folder = std::getenv("TMPDIR");
  std::string name = folder && *folder ? folder : "/var/tmp";
  name += "/deepuav-XXXXXX";
  const int descriptor = mkstemp(name.data());
  if (descriptor < 0) return nullptr;
  unlink(name.c_str());
  return fdopen(descriptor, "w+b");
}

}  // namespace

TemporaryFile::~TemporaryFile() {
  if (file_) std::fclose(file_);
}

std::optional<int64_t> TemporaryFile::Append(std::span<const std::byte> bytes) {
  if (!file_) file_ = OpenNamelessFile();
  if (!file_ || std::fseek(file_, end_, SEEK_SET) != 0) return std::nullopt;
  if (bytes.empty()) return end_;  // C's functions take no null pointer, not even for nothing.
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size() || std::fflush(file_) != 0)
    return std::nullopt;
  const int64_t at = end_;
  end_ += static_cast<int64_t>(bytes.size());
  return at;
}

void TemporaryFile::Read(int64_t at, std::span<std::byte> bytes) {
  if (bytes.empty()) return;
  if (!file_ || std::fseek(file_, at, SEEK_SET) != 0 ||
      std::fread(bytes.data(), 1, bytes.size(), file_) != bytes.size())
    throw Error("a temporary file cannot be read back: {}", std::strerror(errno));
}

}  // namespace deepuav
