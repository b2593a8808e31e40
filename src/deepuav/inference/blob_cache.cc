#include "deepuav/inference/blob_cache.h"

#include <unistd.h>

#include <atomic>
#include <fstream>
#include <iterator>
#include <system_error>

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
}

}  // namespace deepuav
