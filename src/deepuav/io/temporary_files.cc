#include "deepuav/io/temporary_files.h"

#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr size_t kSlots = 64;

// Null where free. Filled under the mutex; a signal handler, which cannot wait, only takes out.
std::array<std::atomic<char*>, kSlots> slots;
std::mutex mutex;
static_assert(std::atomic<char*>::is_always_lock_free);

// The working folder may be another when the program ends.
std::string AbsoluteName(const fs::path& file) {
  std::error_code error;
  const fs::path absolute = fs::absolute(file, error);
  return error ? file.string() : absolute.string();
}

}  // namespace

void RememberTemporaryFile(const fs::path& file) {
  const std::string name = AbsoluteName(file);
  const std::lock_guard lock(mutex);
  for (std::atomic<char*>& slot : slots) {
    if (slot) continue;
    slot = ::strdup(name.c_str());
    return;
  }
}

void ForgetTemporaryFile(const fs::path& file) {
  const std::string wanted = AbsoluteName(file);
  const std::lock_guard lock(mutex);
  for (std::atomic<char*>& slot : slots) {
    char* name = slot;
    if (!name || wanted != name) continue;
    if (slot.compare_exchange_strong(name, nullptr)) std::free(name);
    return;
  }
}

void RemoveTemporaryFiles() noexcept {
  for (std::atomic<char*>& slot : slots) {
    if (const char* name = slot.exchange(nullptr)) ::unlink(name);
  }
}

}  // namespace deepuav
