#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <span>

namespace deepuav {

/// Bytes that wait in a file without a name, which is gone when the program is, however it ends: in
/// $TMPDIR or /var/tmp, which lies on a disk as /tmp need not. Made when it is first written to.
/// One thread at a time.
class TemporaryFile {
 public:
  TemporaryFile() = default;
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Where they begin; nothing, and errno, where there is no room.
  std::optional<int64_t> Append(std::span<const std::byte> bytes);
  /// Throws Error where they cannot be read back.
  void Read(int64_t at, std::span<std::byte> bytes);

 private:
  std::FILE* file_ = nullptr;
  int64_t end_ = 0;
};

}  // namespace deepuav
