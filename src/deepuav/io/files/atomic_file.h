#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace deepuav {

/// A file that appears under its name only when it is complete: written to a temporary name in the
/// same folder, flushed to the disk and renamed by Commit(). Without Commit() nothing is left. A
/// device or pipe is written directly. Every member throws Error naming the file and the reason
/// (full disk, no permission, no such folder).
class AtomicFile {
 public:
  explicit AtomicFile(const std::filesystem::path& file);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void Write(std::string_view bytes);
  /// Nothing may be written afterwards.
  void Commit();

 private:
  void Flush();
  void Discard() noexcept;
  [[noreturn]] void Fail(const char* what);

  std::filesystem::path file_;
  std::filesystem::path target_;     ///< `file_` behind symbolic links.
  std::filesystem::path temporary_;  ///< Empty where the target is written directly.
  std::string buffer_;
  int descriptor_ = -1;
};

/// The whole of a file at once.
void WriteFileAtomically(const std::filesystem::path& file, std::string_view bytes);

}  // namespace deepuav
