#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace deepuav {

/// A folder of byte strings by key. Entries carry their SHA-256 and are renamed into place when
/// complete, so a kill, a full disk or another process at the same time never leaves an entry that
/// would be read wrongly.
class BlobCache {
 public:
  static constexpr uintmax_t kMostBytes = 500'000'000;

  /// An empty folder name switches the cache off. Beyond `most_bytes` the entries that were not
  /// used for the longest time are removed.
  explicit BlobCache(std::filesystem::path folder, uintmax_t most_bytes = kMostBytes)
      : folder_(std::move(folder)), most_bytes_(most_bytes) {}

  /// Nothing when there is no entry or it is damaged.
  std::optional<std::string> Load(const std::string& key) const;

  /// Keeping is best effort: a folder that cannot be written is logged, not an error.
  void Store(const std::string& key, const std::string& bytes) const;

  bool enabled() const { return !folder_.empty(); }

 private:
  std::filesystem::path PathOf(const std::string& key) const;
  void Prune() const;

  std::filesystem::path folder_;
  uintmax_t most_bytes_;
};

}  // namespace deepuav
