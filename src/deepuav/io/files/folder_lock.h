#pragma once

#include <filesystem>

namespace deepuav {

/// Makes the folder and those above it. Throws Error naming it.
void MakeOutputFolder(const std::filesystem::path& folder);

/// Held by the one process that writes into a folder; the system ends it with the process, however
/// that ends. Leaves no file.
class FolderLock {
 public:
  /// Throws Error where another process holds it, or the folder cannot be opened. A file system
  /// without locks locks nothing.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace deepuav
