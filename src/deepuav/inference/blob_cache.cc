#include "deepuav/inference/blob_cache.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <iterator>
#include <system_error>
#include <vector>

#include "deepuav/base/logging.h"
#include "deepuav/base/sha256.h"

namespace deepuav {
namespace {

constexpr size_t kDigestLength = 64;  // hexadecimal digits of a SHA-256

/// Of no other process and no other call.
std::string TemporarySuffix() {
  static std::atomic<int> calls = 0;
  return fmt::format(".{}-{}.tmp", getpid(), calls++);
}

}  // namespace

std::filesystem::path BlobCache::PathOf(const std::string& key) const {
  return folder_ / (Sha256(key) + ".blob");
}

std::optional<std::string> BlobCache::Load(const std::string& key) const {
  if (!enabled()) return std::nullopt;
  std::ifstream stream(PathOf(key), std::ios::binary);
  std::string digest(kDigestLength, '\0');
  if (!stream.read(digest.data(), kDigestLength)) return std::nullopt;
  std::string bytes(std::istreambuf_iterator<char>(stream), {});
  if (Sha256(bytes) != digest) {
    Log().warn("{}: a damaged entry of the cache is not used", PathOf(key).string());
    return std::nullopt;
  }
  std::error_code status;  // Best effort: who cannot write only reads.
  std::filesystem::last_write_time(PathOf(key), std::filesystem::file_time_type::clock::now(),
                                   status);
  return bytes;
}

void BlobCache::Store(const std::string& key, const std::string& bytes) const {
  if (!enabled()) return;
  std::error_code status;
  std::filesystem::create_directories(folder_, status);
  const std::filesystem::path path = PathOf(key);
  const std::filesystem::path temporary = path.string() + TemporarySuffix();
  std::ofstream stream(temporary, std::ios::binary);
  stream << Sha256(bytes) << bytes;
  stream.close();
  if (stream) std::filesystem::rename(temporary, path, status);
  if (!stream || status) {
    Log().warn("{}: the cache cannot be written", path.string());
    std::filesystem::remove(temporary, status);
  }
  Prune();
}

void BlobCache::Prune() const {
  namespace fs = std::filesystem;
  struct Entry {
    fs::file_time_type used;
    uintmax_t bytes;
    fs::path path;
  };
  std::error_code status;  // Of files that another process removes meanwhile.
  const auto abandoned = fs::file_time_type::clock::now() - std::chrono::hours(1);
  std::vector<Entry> entries;
  uintmax_t total = 0;
  for (fs::directory_iterator file(folder_, status), end; file != end; file.increment(status)) {
    if (status) return;
    const auto used = fs::last_write_time(file->path(), status);
    if (status) continue;
    const auto bytes = fs::file_size(file->path(), status);
    if (status) continue;
    if (file->path().extension() == ".tmp" && used < abandoned) fs::remove(file->path(), status);
    if (file->path().extension() != ".blob") continue;
    entries.push_back({used, bytes, file->path()});
    total += bytes;
  }
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.used < b.used; });
  for (const Entry& entry : entries) {
    if (total <= most_bytes_) return;
    fs::remove(entry.path, status);
    total -= entry.bytes;
  }
}

}  // namespace deepuav
